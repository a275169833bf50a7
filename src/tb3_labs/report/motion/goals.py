"""The states and goals of a recorded run, and the errors on the way to each goal.

The run has a local_pose, recorded or completed (see :mod:`tb3_labs.report.motion.movements`). Goals
are in ``local``. Units: metres, radians, seconds since the recording's start.
"""
import math
from dataclasses import dataclass
from typing import List, Optional, Tuple

import numpy as np

from tb3_labs.geometry.angle_arrays import wrap_all
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.report.run_data import RunData, cached_per_run

#: A goal belongs to a state if their messages arrived within this time [s].
SAME_MOMENT = 0.5


@dataclass(frozen=True)
class Span:
    """goal_state was `state` from `begin` to `end`; `goal` is in local, None if unknown."""

    state: str
    begin: float
    end: float
    goal: Optional[Pose2]


@cached_per_run
def spans(run: RunData) -> List[Span]:
    """Returns the states of move_to_goal as Spans, in order.

    A state begins at the stamp of the goal that was sent with it, or else at its arrival.
    """
    begins: List[float] = []
    goals: List[Optional[Pose2]] = []
    for arrival, own in zip(run.states.arrival, _goals_of_states(run)):
        begin = float(arrival) if own is None else min(float(arrival), float(run.goals.time[own]))
        begins.append(max(begins[-1:] + [begin]))
        before = int(np.searchsorted(run.goals.arrival, arrival, side='right')) - 1
        goal = before if own is None else own
        goals.append(run.goals.pose(goal) if goal >= 0 else None)
    ends = begins[1:] + [max(begins[-1:] + [run.duration])]
    return [Span(*span) for span in zip(run.states.words, begins, ends, goals)]


def _goals_of_states(run: RunData) -> List[Optional[int]]:
    """Returns for each state the index of the goal that was sent together with it, or None.

    Each pair is sent in the same order; several may arrive at once if the recorder was busy.
    """
    goals, following = run.goals.arrival, 0
    indices: List[Optional[int]] = []
    for arrival in run.states.arrival:
        following += int(np.searchsorted(goals[following:], arrival - SAME_MOMENT))
        is_near = following < len(goals) and goals[following] < arrival + SAME_MOMENT
        indices.append(following if is_near else None)
        following += is_near
    return indices


@cached_per_run
def goal_errors(run: RunData) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns (time, distance [m], angle [rad]) from the robot to the goal in force, by
    local_pose."""
    local, goals = run.local_pose, [(s.begin, s.goal) for s in spans(run) if s.goal is not None]
    poses = local.take(local.time >= (goals[0][0] if goals else math.inf))
    if not len(poses):
        return np.empty(0), np.empty(0), np.empty(0)
    number = np.searchsorted([begin for begin, _ in goals], poses.time, side='right') - 1
    x, y, yaw = np.array([(goal.x, goal.y, goal.yaw) for _, goal in goals])[number].T
    return poses.time, np.hypot(x - poses.x, y - poses.y), wrap_all(yaw - poses.yaw)
