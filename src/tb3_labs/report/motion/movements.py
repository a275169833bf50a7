"""Finds the movements, states and goals of a run whose node publishes only `cmd_vel`.

The robot's pose in ``local`` is (0, 0, 0) at the first sample, and the declared pose at a reset. As
in the lab, the robot's place follows the odometry, and the robot's heading follows the IMU.

A *movement* is a series of commands that are not zero, with pauses shorter than
`MOVEMENT_PAUSE_TIME`. A reset, or a False on `ctrl_relinq`, divides a movement in two. A turn has
no forward speed. A drive goes forward, and has a turn before or after. A person made any other
movement "by hand".

If `ctrl_relinq` or `joy` was recorded, a movement is a drive while a node has control, and by hand
at any other time. If `mouse_info` was recorded, no movement is a drive, and a turn must be faster
than the mouse can command. Without these topics, a person's drive by keys looks like a node's.
"""
import re
from dataclasses import dataclass, replace
from enum import Enum
from functools import lru_cache
from typing import List, Optional, Tuple

import numpy as np

from tb3_labs.control.goal_state import DRIVING
from tb3_labs.geometry.arrays import index_at_or_before, wrap_all
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.handout import (
    GOAL_REACHED, GOAL_X, GOAL_Y, GOAL_YAW_DEG, MOUSE_FULL, PRINTED_REACHED)
from tb3_labs.recording.run_data import Poses, RunData, Texts
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT
from tb3_labs.supervision.goal_requests import TypedPose
from tb3_labs.watch.mistake import NodeRun

MOVEMENT_PAUSE_TIME = 1.0       # [s]
MIN_MOVING_SPEED = 1e-3         # [m/s, rad/s]
MIN_DRIVE_LENGTH = 0.1          # [m] forward
LAB_GOAL = TypedPose(GOAL_X, GOAL_Y, GOAL_YAW_DEG).pose
CAME_TO_REST = 'came to rest'     # nothing was recorded that says why the drive ended
#: What ends a drive is recorded at most this time [s] before or after its last command.
MAX_CAUSE_DELAY = 0.5


class MovementKind(Enum):
    TURN = 'turn'
    DRIVE = 'drive'
    BY_HAND = 'by hand'


@dataclass(frozen=True)
class Movement:
    """A movement. If no command goes forward, `forward_begin` and `forward_end` equal `end`."""

    kind: MovementKind
    begin: float
    forward_begin: float
    forward_end: float
    end: float


@lru_cache(maxsize=1)
def movements(run: RunData) -> List[Movement]:
    time = run.commands.time
    speeds = np.maximum(np.abs(run.commands.linear), np.abs(run.commands.angular))
    moves = np.flatnonzero(speeds > MIN_MOVING_SPEED)
    if not len(moves):
        return []
    ends = np.minimum(np.append(time[1:], np.inf), time + COMMAND_TIMEOUT)
    # a reset, or the loss of control, cuts off a movement
    cuts = np.concatenate([run.resets.time, run.control.time[run.control.value == 0.0]])
    cut_counts = np.searchsorted(np.sort(cuts), time[moves])     # before each command
    is_cut = np.diff(cut_counts) > 0
    is_pause = time[moves[1:]] - ends[moves[:-1]] >= MOVEMENT_PAUSE_TIME
    first_indices = np.flatnonzero(is_cut | is_pause) + 1
    return [_movement(run, indices, ends) for indices in np.split(moves, first_indices)]


def _movement(run: RunData, moves: np.ndarray, ends: np.ndarray) -> Movement:
    """`moves` are indices of commands. `ends` are the times [s] at which the commands end."""
    time = run.commands.time
    begin = float(time[moves[0]])
    end = float(min(ends[moves[-1]], run.duration))
    forward_begin, forward_end = end, end
    forward = moves[np.abs(run.commands.linear[moves]) > MIN_MOVING_SPEED]
    if len(forward):
        forward_begin = float(time[forward[0]])
        forward_end = float(min(ends[forward[-1]], end))

    has_mouse = 'mouse_info' in run.devices
    kind_by_node = MovementKind.DRIVE
    if len(run.control) or 'joy' in run.devices:
        is_by_node = has_control(run, (begin + end) / 2.0)
    elif len(forward):
        has_turn = moves[0] < forward[0] or moves[-1] > forward[-1]
        length = run.odometry.pose_at(forward_begin).distance_to(run.odometry.pose_at(forward_end))
        is_by_node = has_turn and not has_mouse and length >= MIN_DRIVE_LENGTH
    else:
        kind_by_node = MovementKind.TURN
        fastest = np.abs(run.commands.angular[moves]).max()
        is_by_node = not has_mouse or fastest > MOUSE_FULL + MIN_MOVING_SPEED
    kind = kind_by_node if is_by_node else MovementKind.BY_HAND
    return Movement(kind, begin, forward_begin, forward_end, end)


def has_control(run: RunData, time: float) -> bool:
    """Returns True if a node had control at this time [s]. The first message on ctrl_relinq counts
    as a change, so before this message the node had the opposite."""
    if not len(run.control):
        return False
    earlier_values = run.control.value[run.control.time <= time]
    if not len(earlier_values):
        return not run.control.value[0]
    return bool(earlier_values[-1])


def with_derived_fields(run: RunData, goal: Optional[Pose2] = None) -> RunData:
    """Returns the run with local_pose, frames, states and goals. A field that was not recorded is
    computed, and its name is added to `derived`. Goals that were not recorded are all `goal`. If
    `goal` is None, the lab's goal is assumed, and `derived` has 'goals'."""
    if not len(run.local_pose) and len(run.frames):
        local = run.frames.inverse() @ run.odometry.at(run.frames.time)
        run = replace(run, local_pose=local, derived=run.derived + ('local_pose',))
    elif not len(run.local_pose):
        run = _with_local(run)
    return run if len(run.states) else _with_states(run, goal)


def _with_local(run: RunData) -> RunData:
    odometry = run.odometry
    start = odometry.time[0]
    at_start = Poses.without_stamps([(start, 0.0, 0.0, 0.0)])
    declared = Poses.joined([at_start, run.resets])
    declared = declared.take(np.argsort(declared.time, kind='stable'))
    frames = odometry.at(declared.time) @ declared.inverse()
    imu_yaws = run.imu.yaw_at(declared.time) - declared.yaw
    frame_index = index_at_or_before(declared.time, odometry.time).clip(0)
    odom_T_local = replace(frames.take(frame_index), arrival=odometry.arrival, time=odometry.time)
    local = odom_T_local.inverse() @ odometry
    headings = wrap_all(run.imu.yaw_at(odometry.time) - imu_yaws[frame_index])
    return replace(run, local_pose=replace(local, yaw=headings), frames=odom_T_local,
                   derived=run.derived + ('local_pose', 'frames'))


def _with_states(run: RunData, goal: Optional[Pose2]) -> RunData:
    states = []
    causes = _causes_of_ends(run)
    for movement in movements(run):
        if movement.kind is MovementKind.DRIVE:
            begins = movement.begin, movement.forward_begin, movement.forward_end
            states += [(begin, state) for begin, state in zip(begins, DRIVING)
                       if begin < movement.end]
            if movement.end < run.duration:
                earliest = max(movement.begin, movement.end - MAX_CAUSE_DELAY)
                names = [name for time, name in causes
                         if earliest < time < movement.end + MAX_CAUSE_DELAY]
                states.append((movement.end, names[0] if names else CAME_TO_REST))
    if not states:
        return run
    run = replace(run, states=Texts.without_stamps(states), derived=run.derived + ('states',))
    if len(run.goals):
        return run
    if goal is None:
        goal = LAB_GOAL
        run = replace(run, derived=run.derived + ('goals',))
    first_begin, _ = states[0]
    return replace(run, goals=Poses.without_stamps([(first_begin, goal.x, goal.y, goal.yaw)]))


def _causes_of_ends(run: RunData) -> List[Tuple[float, str]]:
    """Returns (time [s], name) of everything recorded that may end a drive, in order of time."""
    lines = [*zip(run.log.time, run.log.text), *zip(run.printed.time, run.printed.text)]
    causes = [(time, GOAL_REACHED) for time, text in lines
              if re.search(PRINTED_REACHED, text, re.IGNORECASE)]
    state = NodeRun(run).variable('state')
    if state is not None:
        causes += [(time, GOAL_REACHED) for time in state.changes
                   if state.text_at(time) == GOAL_REACHED]
    causes += [(time, 'reset') for time in run.resets.time]
    causes += [(time, 'control taken') for time in run.control.time[run.control.value == 0.0]]
    return sorted(causes)
