"""The drives of a recorded run: their states, errors, drift and times.

Frames: ``odom`` (global), ``local`` (as last declared, see :mod:`tb3_labs.report.motion.epochs`),
``world`` (of the ground truth).

The run has a local_pose, recorded or completed (see :mod:`tb3_labs.report.motion.movements`).

Units: metres, radians, seconds since the recording's start on the recorder's clock.
Edge cases: an unknown value (no ground truth, no sample in time) is NaN.
"""
import math
from dataclasses import dataclass
from typing import List, Optional, Sequence, Tuple

import numpy as np

from tb3_labs.control.goal_state import DRIVING, DriveConfig, GoalState, is_stopped, sum_of_turns
from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.report.motion.epochs import Epoch, epoch_of, epochs
from tb3_labs.report.motion.goals import Span, spans
from tb3_labs.report.motion.movements import STRAIGHT_AFTER
from tb3_labs.report.run_data import GAP, Poses, RunData
from tb3_labs.robot.turtlebot3 import RobotModel

#: The errors of a drive are measured at rest, at most this long after its end [s].
SETTLE_TIME = 1.0
#: Fastest turn in the least possible time of a drive [rad/s]: the package's own limit.
MAX_ANGULAR = DriveConfig().max_angular
#: An unknown (distance, angle).
UNKNOWN = math.nan, math.nan

FIRST, STRAIGHT, LAST = DRIVING


@dataclass(frozen=True)
class DriveReport:
    """One drive: from its first ROTATE_TO_GOAL to its end."""

    begin: float
    end: float
    goal: Optional[Pose2]             # in local
    outcome: str                      # 'reached', or the reason why not
    measured: Tuple[float, float]     # (distance [m], angle [rad]) off, by local_pose
    true: Tuple[float, float]         # (distance, angle) off, by the ground truth
    drift: float                      # heading after driving straight minus before [rad]
    deviation: float                  # largest difference from the heading before [rad]
    seconds: Tuple[float, ...]        # in each state of DRIVING
    least_time: float                 # [s], see :func:`least_time`

    @property
    def time(self) -> float:
        """From begin to end [s]."""
        return self.end - self.begin

    @property
    def time_to_least(self) -> float:
        """The time as a multiple of the least possible one."""
        return self.time / self.least_time if self.least_time else math.nan


def drives(run: RunData, model: RobotModel) -> List[DriveReport]:
    """Returns a DriveReport for each drive; `model` is the robot that drove."""
    states, frames, reports, k = spans(run), epochs(run), [], 0
    while k < len(states):
        last = k + 1
        if states[k].state in DRIVING:
            while last < len(states) and _goes_on(frames, *states[last - 1:last + 1]):
                last += 1
            reports.append(_drive(run, model, frames, states[k:last], states[last:]))
        k = last
    return reports


def _goes_on(frames: Sequence[Epoch], span: Span, following: Span) -> bool:
    """Does `following` belong to the same drive as `span`?"""
    if following.state != FIRST:
        return following.state in DRIVING or is_stopped(following.state)
    # the robot stopped outside its tolerance, or was interrupted, and drives to the same goal again
    return (span.state == LAST or is_stopped(span.state)) and span.goal == following.goal and (
        epoch_of(frames, span.begin, span.end)
        is epoch_of(frames, following.begin, following.end))


def _drive(run: RunData, model: RobotModel, frames: Sequence[Epoch], parts: Sequence[Span],
           later: Sequence[Span]) -> DriveReport:
    begin, end, goal = parts[0].begin, parts[-1].end, parts[0].goal
    epoch = epoch_of(frames, begin, end)
    rest = end
    if later and later[0].state != FIRST:
        rest = min(end + SETTLE_TIME, later[0].end)
    local = run.local_pose.between(epoch.begin, min(rest, epoch.end))
    truth = run.ground_truth.between(epoch.begin, min(rest, epoch.end))
    if epoch.local_T_world is not None:
        truth = truth.seen_from(epoch.local_T_world)
    drift, deviation = _drift(run, parts)
    seconds = tuple(sum((part.end - part.begin for part in parts if part.state == state), 0.0)
                    for state in DRIVING)
    least = math.nan
    if goal is not None and len(local):
        least = least_time(local.at(begin), goal, model, max_angular=MAX_ANGULAR)
    return DriveReport(
        begin, end, goal, _outcome(frames, parts, later), _miss(local, goal, end),
        UNKNOWN if epoch.local_T_world is None else _miss(truth, goal, end),
        drift, deviation, seconds, least)


def _miss(poses: Poses, goal: Optional[Pose2], end: float) -> Tuple[float, float]:
    """Returns (distance, angle) from the last pose to the goal; UNKNOWN if a gap follows it."""
    if goal is None or not len(poses) or poses.time[-1] < end - GAP:
        return UNKNOWN
    last = poses.pose(-1)
    return last.distance_to(goal), difference(goal.yaw, last.yaw)


def _drift(run: RunData, parts: Sequence[Span]) -> Tuple[float, float]:
    """(drift, deviation) of the IMU's heading in the longest stretch of straight driving."""
    straight = max((part for part in parts if part.state == STRAIGHT),
                   key=lambda part: part.end - part.begin, default=None)
    yaw = np.empty(0)
    if straight is not None:
        yaw = np.unwrap(run.imu.between(straight.begin + STRAIGHT_AFTER, straight.end).yaw)
    if len(yaw) < 2:
        return UNKNOWN
    return float(yaw[-1] - yaw[0]), float(np.abs(yaw - yaw[0]).max())


def _outcome(frames: Sequence[Epoch], parts: Sequence[Span], later: Sequence[Span]) -> str:
    if not later:
        return 'recording ended'
    state = later[0].state
    if state == GoalState.GOAL_REACHED.name:
        return 'reached'
    if state != FIRST:
        return state
    if later[0].goal != parts[0].goal:
        return 'replaced by a new goal'
    if epoch_of(frames, parts[0].begin, parts[-1].end) is not epoch_of(
            frames, later[0].begin, later[0].end):
        return 'ended by a reset'
    return 'begun anew'


def least_time(start: Pose2, goal: Pose2, model: RobotModel, max_linear: float = math.inf,
               max_angular: float = math.inf, reverse: bool = False) -> float:
    """Least time [s] from pose to pose by a turn, a straight line and a turn.

    If the wheels are the only limit, this time is (Balkcom and Mason, Time optimal trajectories for
    bounded velocity differential drive vehicles, 2002)
    (b (|turn1| + |turn2|) + distance) / V, with b half the track and V a wheel's speed. The limits
    `max_linear` [m/s] and `max_angular` [rad/s] can make the time longer.
    """
    linear = min(max_linear, model.max_linear)
    angular = min(max_angular, model.max_angular)
    line = start.bearing_to(goal)
    return min(sum_of_turns(start.yaw, face, goal.yaw) / angular + start.distance_to(goal) / linear
               for face in ((line, line + math.pi) if reverse else (line,)))
