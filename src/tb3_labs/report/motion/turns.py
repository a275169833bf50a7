"""Finds the turns of the IMU lab in a recorded run, and measures each turn from rest to rest.

The requested angle of a turn comes from `recorded_requests`. If no request was recorded for a turn,
the requested angle is the nearest of the lab's angles, +/-90 and +/-180 degrees. Angles are
positive to the left. The IMU's yaw is unwrapped, so an angle may be larger than half a turn.
"""
import math
from dataclasses import dataclass
from functools import lru_cache
from typing import List, Optional, Tuple

import numpy as np

from tb3_labs.control.goal_state import DRIVING
from tb3_labs.handout import LEFT_KEY, RIGHT_KEY
from tb3_labs.recording.run_data import ImuSamples, Numbers, RunData
from tb3_labs.report.motion.movements import MIN_MOVING_SPEED, Movement, MovementKind, movements
from tb3_labs.report.motion.resets_and_goals import recorded_states
from tb3_labs.robot.samples import MAX_REST_TURN_RATE
from tb3_labs.watch.mistake import NodeRun
from tb3_labs.watch.typed_turns import TURN_OF_LETTER_DEG, letter_turns

#: A robot rests if its mean rate of turn over this time [s] is below MAX_REST_TURN_RATE.
RATE_MEAN_TIME = 0.15
#: The robot has come to rest within this time [s] after the last command.
MAX_STOPPING_TIME = 2.0
#: After RATE_MEAN_TIME at rest, the heading is averaged over this time [s].
HEADING_MEAN_TIME = 0.3
#: The recorder may miss up to this time [s] of a new node's first turn.
MAX_MISSED_TIME = 1.0
#: Without a recorded request, a movement by a smaller angle [rad] is not a turn.
MIN_TURN_ANGLE = math.radians(45.0)
MIN_HALF_TURN = 0.75 * math.pi      # a smaller angle is nearer to a quarter turn
MIN_PAUSE_BETWEEN_TURNS = 0.5       # [s]
MAX_REQUEST_LEAD = 2.0              # a request comes at most this time [s] before its turn


@dataclass(frozen=True)
class TurnReport:
    """The report of a turn, from rest to rest."""

    begin: float
    end: float                        # when the robot is at rest again
    requested: float
    turned: float                     # the angle by the IMU
    error: float                      # positive if the robot turned too far
    true_error: float                 # the error by the ground truth


@lru_cache(maxsize=1)
def turn_reports(run: RunData) -> List[TurnReport]:
    driving_states = [state for state in recorded_states(run) if state.name in DRIVING]
    all_movements = movements(run)
    next_begins = [movement.begin for movement in all_movements[1:]] + [run.duration]
    reports: List[TurnReport] = []
    previous_end = 0.0
    for movement, next_begin in zip(all_movements, next_begins):
        is_part_of_drive = any(state.begin < movement.end and movement.begin < state.end
                               for state in driving_states)
        if movement.kind is not MovementKind.TURN or is_part_of_drive:
            continue
        for begin, end, next_command in _separate_turns(run, movement, next_begin):
            report = _turn_report(run, begin, end, next_command, previous_end)
            if report is not None:
                reports.append(report)
                previous_end = report.end
    return reports


def _separate_turns(run: RunData, movement: Movement,
                    next_begin: float) -> List[Tuple[float, float, float]]:
    """Returns (begin, end, next command's time) of each turn, which includes quick corrections."""
    commands = run.commands.between(movement.begin, movement.end)
    times = commands.time[np.abs(commands.angular) > MIN_MOVING_SPEED]
    first_after_pause = np.flatnonzero(np.diff(times) > MIN_PAUSE_BETWEEN_TURNS) + 1
    begins = [movement.begin, *times[first_after_pause].tolist()]
    next_begins = [*begins[1:], next_begin]
    ends = [*times[first_after_pause - 1].tolist(), movement.end]
    return list(zip(begins, ends, next_begins))


def _turn_report(run: RunData, begin: float, end: float, next_command: float,
                 previous_end: float) -> Optional[TurnReport]:
    """Returns the report of the commands from `begin` to `end`, or None if they make no turn."""
    times_before = begin - np.arange(0.0, MAX_MISSED_TIME, RATE_MEAN_TIME / 3.0)
    interval_before = _first_rest(run.imu, times_before - RATE_MEAN_TIME, times_before)
    latest = min(end + MAX_STOPPING_TIME, next_command)
    times_after = run.imu.between(end, latest).time
    ends_after = np.minimum(times_after + RATE_MEAN_TIME, latest)
    interval_after = _first_rest(run.imu, times_after, ends_after)
    if interval_before is None or interval_after is None:
        return None

    _, rest_before = interval_before
    rest_after, _ = interval_after
    last = min(rest_after + RATE_MEAN_TIME + HEADING_MEAN_TIME, next_command)
    turned = _turned_angle(run.imu.between(rest_before - RATE_MEAN_TIME, last),
                           rest_before, rest_after)
    first_request = max(rest_before - MAX_REQUEST_LEAD, previous_end)
    requested = _requested_angle(run, first_request, end, turned)
    if not requested:
        return None
    sign = math.copysign(1.0, requested)
    return TurnReport(rest_before, rest_after, requested, turned,
                      error=sign * turned - abs(requested),
                      true_error=sign * _true_angle(run, rest_before, last) - abs(requested))


def _first_rest(imu: ImuSamples, begins: np.ndarray,
                ends: np.ndarray) -> Optional[Tuple[float, float]]:
    """Returns (begin, end) of the first interval in which the robot rests, or None."""
    for begin, end in zip(begins, ends):
        rates = imu.between(begin, end).yaw_rate
        if len(rates) and abs(rates.mean()) < MAX_REST_TURN_RATE:
            return float(begin), float(end)
    return None


def _turned_angle(imu: ImuSamples, rest_before: float, rest_after: float) -> float:
    """Returns the mean heading at rest after a turn, minus the mean heading at rest before."""
    yaw = np.unwrap(imu.yaw)
    yaw -= yaw[imu.time <= rest_before].mean()
    is_resting = imu.time >= rest_after + RATE_MEAN_TIME
    if not is_resting.any():
        is_resting = imu.time >= rest_after
    return float(yaw[is_resting].mean())


@lru_cache(maxsize=1)
def recorded_requests(run: RunData) -> Numbers:
    """Returns the requested angles [rad] from the first of these sources that has any: the topic
    `turn`, the letters that a trial typed, the variables curr_yaw and goal_yaw of nodes."""
    if len(run.turn_requests):
        return run.turn_requests
    typed = _typed_requests(run)
    return typed if len(typed) else _requests_by_goal_yaw(run)


def _typed_requests(run: RunData) -> Numbers:
    typed = Numbers.without_stamps(
        [(time, math.radians(TURN_OF_LETTER_DEG[line]))
         for time, text in zip(run.printed.arrival.tolist(), run.printed.text)
         for line in text.splitlines() if line in (LEFT_KEY, RIGHT_KEY)])
    # the terminal shows each letter, and a node may print the letter again
    is_first_print = np.diff(typed.time, prepend=-np.inf) > MIN_PAUSE_BETWEEN_TURNS
    return typed.take(is_first_print)


def _requests_by_goal_yaw(run: RunData) -> Numbers:
    """Returns the angles [rad] from curr_yaw to goal_yaw at the start of each turn, in whole
    degrees. The angles are rounded, because the probe shows both variables a moment late."""
    first_errors_deg = [(turn.begin, turn.error[0]) for node in sorted(set(run.variables.node))
                        for turn in letter_turns(NodeRun(run, node)) if len(turn.error)]
    return Numbers.without_stamps(
        [(time, math.radians(round(error_deg))) for time, error_deg in sorted(first_errors_deg)
         if math.isfinite(error_deg)])


def _requested_angle(run: RunData, begin: float, end: float, turned: float) -> float:
    """Returns the requested angle [rad], or 0 if the movement was not a turn."""
    requests = recorded_requests(run).between(begin, end)
    if len(requests):
        return float(requests.value.sum())
    if abs(turned) < MIN_TURN_ANGLE:
        return 0.0
    nearest = math.pi / 2.0 if abs(turned) < MIN_HALF_TURN else math.pi
    return math.copysign(nearest, turned)


def _true_angle(run: RunData, begin: float, end: float) -> float:
    truth = run.ground_truth
    if not len(truth) or truth.time[0] > begin or truth.time[-1] < end:
        return math.nan
    before, after = truth.yaw_at((begin, end))
    return float(after - before)
