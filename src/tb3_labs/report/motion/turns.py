"""The turns of the IMU lab in a recorded run: by how much the robot turned, from rest to rest.

A turn is a movement without forward speed (see :mod:`tb3_labs.report.motion.movements`). The robot
rests before and after it. Topic `turn` has the requested angle. Without a message on
`turn`, the nearest of +/-90 and 180 degrees is taken, since the lab asks for these; a movement by
less than `LEAST_TURN` or more than `MOST_TURN` is then not a turn.

Units: radians, left positive; seconds. A turn by more than half a turn is counted in full, since
the IMU's yaw is unwrapped. Edge case: an unknown value (no ground truth) is NaN.
"""
import math
from dataclasses import dataclass
from typing import List, Optional, Tuple

import numpy as np

from tb3_labs.control.goal_state import DRIVING
from tb3_labs.report.motion.movements import NO_SPEED, TERMINAL, Kind, Movement, movements, programs
from tb3_labs.report.motion.resets_and_goals import spans
from tb3_labs.report.run_data import ImuSamples, RunData, cached_per_run

#: A robot rests if its mean rate of turn over REST_WINDOW [s] is less than AT_REST [rad/s].
AT_REST, REST_WINDOW = 0.03, 0.15
#: A robot comes to rest within REST_WAIT [s] after the last command. Its heading at rest is the
#: mean over REST_MEAN [s]; this time begins REST_WINDOW [s] after it came to rest.
REST_WAIT, REST_MEAN = 2.0, 0.3
#: The recorder may miss a new node's first commands: a rest may be this long before [s].
MISSED = 1.0
#: Nobody asked for a turn smaller than LEAST_TURN [rad]; one larger than MOST_TURN is a spin.
LEAST_TURN = math.radians(45.0)
MOST_TURN = math.radians(225.0)
#: At most this many turns follow each other at once.
MOST_PARTS = 100
#: A motion of a larger angle is a turn [rad].
LEAST_BY_NODE = math.radians(5.0)
#: A turn may be asked for this long before it begins [s].
REQUESTED_BEFORE = 2.0


@dataclass(frozen=True)
class TurnReport:
    """One turn, from rest to rest."""

    begin: float
    end: float                        # the robot rests
    requested: float
    was_sent: bool                    # known by topic `turn`; else the nearest of +/-90 and 180 deg
    turned: float                     # by the IMU
    true: float                       # by the ground truth
    peak_rate: float                  # [rad/s], by the gyro
    overshoot: float                  # largest angle beyond the asked angle during the turn

    @property
    def time(self) -> float:
        """From the first command until the robot rests [s]."""
        return self.end - self.begin

    @property
    def error(self) -> float:
        """The angle beyond the asked one, in its direction [rad]; negative: short of it."""
        return self._beyond(self.turned)

    @property
    def true_error(self) -> float:
        """The `error` by the ground truth [rad]."""
        return self._beyond(self.true)

    def _beyond(self, turned: float) -> float:
        return math.copysign(1.0, self.requested) * turned - abs(self.requested)


@cached_per_run
def turns(run: RunData) -> List[TurnReport]:
    """A TurnReport for each turn, in order."""
    driven = [(span.begin, span.end) for span in spans(run) if span.state in DRIVING]
    everything = movements(run)
    ends = [movement.begin for movement in everything[1:]] + [run.duration]
    reports: List[TurnReport] = []
    for movement, until in zip(everything, ends):
        if movement.kind is Kind.TURN and not any(
                begin < movement.end and movement.begin < end for begin, end in driven):
            since = reports[-1].end if reports else 0.0
            for begin, end, later in _parts(run, movement, until):
                report = _turn(run, begin, end, later, since)
                if report is not None:
                    reports.append(report)
                    since = report.end
    return reports


def _parts(run: RunData, movement: Movement, until: float) -> List[Tuple[float, float, float]]:
    """The turns within one movement, as (first command, last command's end, next command).

    Between two turns in quick succession the robot rests, and it turns far in each of them. A
    correction of one turn is not a turn by itself.
    """
    commands = run.commands.between(movement.begin, movement.end)
    turning = np.abs(commands.angular) > NO_SPEED
    stops = np.flatnonzero(turning[:-1] & ~turning[1:]) + 1
    parts, begin = [], movement.begin
    for k in stops[:MOST_PARTS]:
        stop, go = float(commands.time[k]), float(commands.time[k + int(np.argmax(turning[k:]))])
        if go > stop and _turn(run, begin, stop, go, math.inf) and (
                _turn(run, go, movement.end, until, math.inf)):
            parts.append((begin, stop, go))
            begin = go
    return parts + [(begin, movement.end, until)]


def _turn(run: RunData, begin: float, end: float, until: float,
          since: float) -> Optional[TurnReport]:
    """Returns the turn by the commands from `begin` to `end`; None if it is not a turn. The robot
    may rest up to `until`, the time of its next command. A request before `since` belongs to
    another turn."""
    latest = min(end + REST_WAIT, until)
    before = next((float(time) for time in begin - np.arange(0.0, MISSED, REST_WINDOW / 3.0)
                   if _rests(run.imu, time - REST_WINDOW, time)), None)
    rest = next((float(time) for time in run.imu.between(end, latest).time
                 if _rests(run.imu, time, min(time + REST_WINDOW, latest))), None)
    if before is None or rest is None:
        return None
    settled = min(rest + REST_WINDOW + REST_MEAN, until)
    imu = run.imu.between(before - REST_WINDOW, settled)
    yaw = np.unwrap(imu.yaw)
    yaw -= yaw[imu.time <= before].mean()
    at_rest = imu.time >= rest + REST_WINDOW
    turned = float(yaw[at_rest if at_rest.any() else imu.time >= rest].mean())
    requested, was_sent = _requested(run, max(before - REQUESTED_BEFORE, since), end, turned)
    if not requested:
        return None
    on_the_way = math.copysign(1.0, requested) * yaw - abs(requested)
    return TurnReport(
        before, rest, requested, was_sent, turned, _true(run, before, settled),
        float(np.abs(imu.yaw_rate).max()), max(0.0, float(on_the_way.max())))


def _rests(imu: ImuSamples, begin: float, end: float) -> bool:
    """Does the robot rest from `begin` to `end`? Without a sample nobody knows if it rests."""
    rates = imu.between(begin, end).yaw_rate
    return len(rates) > 0 and bool(abs(rates.mean()) < AT_REST)


def _requested(run: RunData, since: float, end: float, turned: float) -> Tuple[float, bool]:
    """Returns (the angle that was asked for, 0 if there was none; was it sent on topic `turn`?)."""
    sent = run.turn_requests.between(since, end)
    if len(sent):
        return float(sent.value.sum()), True
    if not LEAST_TURN <= abs(turned) <= MOST_TURN and not (
            {*programs(run, since, end)} - {TERMINAL} and abs(turned) > LEAST_BY_NODE):
        return 0.0, False
    quarters = 1.0 if abs(turned) < math.radians(135.0) else 2.0
    return math.copysign(quarters * math.pi / 2.0, turned), False


def _true(run: RunData, begin: float, end: float) -> float:
    truth = run.ground_truth
    if not len(truth) or truth.time[0] > begin or truth.time[-1] < end:
        return math.nan
    before, after = truth.yaw_at((begin, end))
    return float(after - before)
