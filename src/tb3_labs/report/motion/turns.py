"""Finds the turns of the IMU lab in a recorded run, and measures each turn from rest to rest.

A turn is a movement without forward speed (see :mod:`tb3_labs.report.motion.movements`). The robot
rests before and after a turn. Topic `turn` gives the requested angle. Without a message on `turn`,
the requested angle is the nearest of the lab's angles, +/-90 and +/-180 degrees. A movement without
a message on `turn`, and with an angle below `MIN_TURN`, is not a turn.

Units: radians (positive to the left), seconds. The IMU's yaw is unwrapped, so that an angle may be
larger than half a turn. Edge case: without ground truth, the true values are NaN.
"""
import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Callable, List, Optional, Tuple

import numpy as np

from tb3_labs.control.goal_state import DRIVING
from tb3_labs.recording.run_data import ImuSamples, RunData
from tb3_labs.report.motion.movements import NO_SPEED, Movement, MovementKind, movements
from tb3_labs.report.motion.resets_and_goals import recorded_states
from tb3_labs.robot.samples import MAX_REST_TURN_RATE

#: A robot rests if its mean rate of turn over this time [s] is below MAX_REST_TURN_RATE.
REST_WINDOW = 0.15
#: The robot has come to rest within this time [s] after the last command.
REST_WAIT = 2.0
#: After REST_WINDOW at rest, the heading is averaged over this time [s].
REST_MEAN = 0.3
#: A turn may begin up to this time [s] before its first recorded command, since the recorder may
#: miss the first commands of a new node.
MAX_MISSED = 1.0
#: Without a message on `turn`, a movement by a smaller angle [rad] is not a turn.
MIN_TURN = math.radians(45.0)
#: A longer pause [s] between turning commands separates two turns.
TURN_PAUSE = 0.5
#: The request of a turn comes at most this time [s] before the turn begins.
MAX_REQUEST_LEAD = 2.0


@dataclass(frozen=True)
class TurnReport:
    """The report of a turn, from rest to rest."""

    begin: float
    end: float                        # from then on the robot rests again
    requested: float
    turned: float                     # by the IMU
    error: float                      # turned beyond the requested angle; negative if too short
    true_error: float                 # the error by the ground truth


@lru_cache(maxsize=1)
def turn_reports(run: RunData) -> List[TurnReport]:
    """Returns a TurnReport for each turn, in order."""
    driven = [interval for interval in recorded_states(run) if interval.state in DRIVING]
    all_movements = movements(run)
    next_begins = [movement.begin for movement in all_movements[1:]] + [run.duration]
    reports: List[TurnReport] = []
    since = 0.0
    for movement, next_begin in zip(all_movements, next_begins):
        is_driven = any(
            interval.begin < movement.end and movement.begin < interval.end for interval in driven)
        if movement.kind is not MovementKind.TURN or is_driven:
            continue
        for begin, end, until in _separate_turns(run, movement, next_begin):
            report = _turn(run, begin, end, next_command=until, since=since)
            if report is not None:
                reports.append(report)
                since = report.end
    return reports


def _separate_turns(run: RunData, movement: Movement,
                    until: float) -> List[Tuple[float, float, float]]:
    """Returns (begin, end, time of the next command) of each turn within one movement. `until` is
    the time of the first command after the movement. Only a pause of TURN_PAUSE separates two
    turns, so a turn includes its quick corrections."""
    commands = run.commands.between(movement.begin, movement.end)
    times = commands.time[np.abs(commands.angular) > NO_SPEED]
    first_after_pause = np.flatnonzero(np.diff(times) > TURN_PAUSE) + 1
    begins = [movement.begin, *times[first_after_pause].tolist()]
    next_begins = [*begins[1:], until]
    ends = [*times[first_after_pause - 1].tolist(), movement.end]
    return list(zip(begins, ends, next_begins))


def _turn(run: RunData, begin: float, end: float, next_command: float,
          since: float) -> Optional[TurnReport]:
    """Returns the report of the turn that the commands from `begin` to `end` make; None if these
    commands are not a turn. The next command comes at `next_command`. A request before `since`
    belongs to an earlier turn."""
    times_before = begin - np.arange(0.0, MAX_MISSED, REST_WINDOW / 3.0)
    rest_before = _first_time(
        times_before, lambda time: _rests(run.imu, time - REST_WINDOW, time))
    latest = min(end + REST_WAIT, next_command)
    rest_after = _first_time(run.imu.between(end, latest).time,
                             lambda time: _rests(run.imu, time, min(time + REST_WINDOW, latest)))
    if rest_before is None or rest_after is None:
        return None
    last = min(rest_after + REST_WINDOW + REST_MEAN, next_command)
    imu = run.imu.between(rest_before - REST_WINDOW, last)
    yaw = np.unwrap(imu.yaw)
    yaw -= yaw[imu.time <= rest_before].mean()
    is_at_rest = imu.time >= rest_after + REST_WINDOW
    if not is_at_rest.any():
        is_at_rest = imu.time >= rest_after
    turned = float(yaw[is_at_rest].mean())
    requested = _requested(run, max(rest_before - MAX_REQUEST_LEAD, since), end, turned)
    if not requested:
        return None
    sign = math.copysign(1.0, requested)
    return TurnReport(rest_before, rest_after, requested, turned,
                      error=sign * turned - abs(requested),
                      true_error=sign * _true_turn(run, rest_before, last) - abs(requested))


def _first_time(times: np.ndarray, is_true: Callable[[float], bool]) -> Optional[float]:
    return next((time for time in times.tolist() if is_true(time)), None)


def _rests(imu: ImuSamples, begin: float, end: float) -> bool:
    """Does the robot rest from `begin` to `end` [s]? Returns False without IMU samples."""
    rates = imu.between(begin, end).yaw_rate
    return len(rates) > 0 and bool(abs(rates.mean()) < MAX_REST_TURN_RATE)


def _requested(run: RunData, since: float, end: float, turned: float) -> float:
    """Returns the requested angle [rad]; 0 if the movement was not a turn."""
    sent = run.turn_requests.between(since, end)
    if len(sent):
        return float(sent.value.sum())
    if abs(turned) < MIN_TURN:
        return 0.0
    quarters = 1.0 if abs(turned) < math.radians(135.0) else 2.0
    return math.copysign(quarters * math.pi / 2.0, turned)


def _true_turn(run: RunData, begin: float, end: float) -> float:
    truth = run.ground_truth
    if not len(truth) or truth.time[0] > begin or truth.time[-1] < end:
        return math.nan
    before, after = truth.yaw_at((begin, end))
    return float(after - before)
