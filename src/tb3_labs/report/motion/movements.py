"""Finds the movements, states and goals of a run whose node publishes only `cmd_vel`.

`completed` adds the topics that the package's own nodes publish. The states and the goals of drives
are found by the movements. The robot's pose in ``local`` is (0, 0, 0) at the first sample, and the
declared pose at a reset. As in the lab, its place follows the odometry, and its heading follows the
IMU. So if the odometry jumps, then this pose jumps, too.

A *movement* is a stretch of commands that are not zero. Its pauses are shorter than
`MOVEMENT_PAUSE`. A reset, or a False on `ctrl_relinq`, divides a movement in two. A movement is a

* turn, if no command has a forward speed;
* drive, if a turn, a way forward and a turn were commanded; one of the two turns may be missing;
* movement by hand, if it is not a turn and not a drive.

Other topics decide if they were recorded. With `ctrl_relinq` or `joy`, a movement is a drive while
a node has control, and by hand at any other time. With `mouse_info`, no movement is a drive, and a
turn must be faster than the mouse can command. Without these topics, a person's drive by keys looks
like a node's drive.

Units: metres, radians, seconds since the recording's start.
Edge cases: a command is in force until the next command, at most for the robot's timeout. A run
without commands has no movements.
"""
from dataclasses import dataclass, replace
from enum import Enum
from typing import List, Tuple

import numpy as np

from tb3_labs.control.goal_state import DRIVING
from tb3_labs.geometry.arrays import last_until, wrap_all
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.handout import GOAL_X, GOAL_Y, GOAL_YAW_DEG, MOUSE_FULL
from tb3_labs.recording.run_data import Commands, Poses, RunData, States, cached_per_run
from tb3_labs.report.motion.resets_and_goals import robot_in_odom
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT
from tb3_labs.supervision.goal_requests import TypedPose

#: A movement ends if no command moves the robot for this time [s].
MOVEMENT_PAUSE = 1.0
#: A speed below this counts as zero [m/s], [rad/s].
NO_SPEED = 1e-3
#: A drive moves the robot at least this far [m].
MIN_DRIVE_LENGTH = 0.1
LAB_GOAL = TypedPose(GOAL_X, GOAL_Y, GOAL_YAW_DEG).pose
#: The state after a drive.
CAME_TO_REST = 'came to rest'


class MovementKind(Enum):
    TURN = 'turn'
    DRIVE = 'drive'
    BY_HAND = 'by hand'


@dataclass(frozen=True)
class Movement:
    """A movement from `begin` to `end`. Its commands have a forward speed from `forward` to
    `turns_again`; if these times are equal, no command has a forward speed."""

    kind: MovementKind
    begin: float
    forward: float
    turns_again: float
    end: float


def moving(commands: Commands) -> np.ndarray:
    """Returns for each command whether it moves the robot."""
    return (np.abs(commands.linear) > NO_SPEED) | (np.abs(commands.angular) > NO_SPEED)


@cached_per_run
def movements(run: RunData) -> List[Movement]:
    time = run.commands.time
    moves = np.flatnonzero(moving(run.commands))
    if not len(moves):
        return []
    ends = np.minimum(np.append(time[1:], np.inf), time + COMMAND_TIMEOUT)
    # a reset, or the loss of control, cuts off a movement
    cuts = np.concatenate([run.resets.time, run.control.time[run.control.value == 0.0]])
    is_cut = np.diff(np.searchsorted(np.sort(cuts), time[moves])) > 0
    begins, previous_ends = time[moves[1:]], ends[moves[:-1]]
    is_pause = begins - previous_ends >= MOVEMENT_PAUSE
    parts = np.split(moves, np.flatnonzero(is_cut | is_pause) + 1)
    return [_movement(run, part, ends) for part in parts]


def _movement(run: RunData, moves: np.ndarray, ends: np.ndarray) -> Movement:
    """Returns the Movement of the commands with the indices `moves`. `ends` are the times
    at which the run's commands end [s]."""
    time = run.commands.time
    begin, end = float(time[moves[0]]), float(min(ends[moves[-1]], run.duration))
    forward = turns_again = end
    ahead = moves[np.abs(run.commands.linear[moves]) > NO_SPEED]
    if len(ahead):
        forward, turns_again = float(time[ahead[0]]), float(min(ends[ahead[-1]], end))
    if len(run.control) or 'joy' in run.devices:
        is_drive = has_control(run, (begin + end) / 2.0)
        kind = MovementKind.DRIVE if is_drive else MovementKind.BY_HAND
    elif len(ahead):
        has_turn = moves[0] < ahead[0] or moves[-1] > ahead[-1]
        may_be_drive = has_turn and 'mouse_info' not in run.devices
        length = run.odometry.at(forward).distance_to(run.odometry.at(turns_again))
        is_drive = may_be_drive and length >= MIN_DRIVE_LENGTH
        kind = MovementKind.DRIVE if is_drive else MovementKind.BY_HAND
    else:
        is_fast = np.abs(run.commands.angular[moves]).max() > MOUSE_FULL + NO_SPEED
        is_turn = is_fast or 'mouse_info' not in run.devices
        kind = MovementKind.TURN if is_turn else MovementKind.BY_HAND
    return Movement(kind, begin, forward, turns_again, end)


def has_control(run: RunData, time: float) -> bool:
    """Did a node have control at this time [s]? The first message on ctrl_relinq changed who has
    control, so the answer before this message is its opposite."""
    if not len(run.control):
        return False
    before = run.control.value[run.control.time <= time]
    return bool(before[-1]) if len(before) else not run.control.value[0]


def completed(run: RunData, goal: Pose2 = LAB_GOAL) -> RunData:
    """Returns the run with local_pose, frames, states and goals. Fields that were not recorded are
    computed, and named in `derived`. Without recorded goals, all drives have this `goal`."""
    if not len(run.local_pose) and len(run.frames):
        local = run.frames.inverse() @ robot_in_odom(run, run.frames.time)
        run = replace(run, local_pose=local, derived=run.derived + ('local_pose',))
    elif not len(run.local_pose):
        run = _with_local(run)
    return run if len(run.states) else _with_states(run, goal)


def _with_local(run: RunData) -> RunData:
    odometry, resets = run.odometry, run.resets
    declared = [(float(odometry.time[0]), Pose2())]
    declared += [(float(time), resets.pose(k)) for k, time in enumerate(resets.time)]
    declared.sort(key=lambda reset: reset[0])
    frames = []
    for time, local_T_base in declared:
        frame = odometry.at(time) @ local_T_base.inverse()
        imu_yaw = float(run.imu.yaw_at(time)) - local_T_base.yaw
        frames.append((frame.x, frame.y, frame.yaw, imu_yaw))
    number = last_until([time for time, _ in declared], odometry.time)
    x, y, yaw, imu_yaws = np.array(frames)[number.clip(0)].T
    odom_T_local = Poses(odometry.arrival, odometry.time, x, y, yaw)
    local = odom_T_local.inverse() @ odometry
    heading = wrap_all(run.imu.yaw_at(odometry.time) - imu_yaws)
    return replace(run, local_pose=replace(local, yaw=heading), frames=odom_T_local,
                   derived=run.derived + ('local_pose', 'frames'))


def _with_states(run: RunData, goal: Pose2) -> RunData:
    begins: List[Tuple[float, str]] = []
    for movement in movements(run):
        if movement.kind is MovementKind.DRIVE:
            begins += _states_of_drive(movement)
            if movement.end < run.duration:
                begins.append((movement.end, CAME_TO_REST))
    if not begins:
        return run
    time = np.array([begin for begin, _ in begins])
    names = np.array([word for _, word in begins], dtype=object)
    run = replace(run, states=States(time, time, names), derived=run.derived + ('states',))
    if len(run.goals):
        return run
    goals = Poses(time, time, *(np.full(len(time), value) for value in (goal.x, goal.y, goal.yaw)))
    return replace(run, goals=goals, derived=run.derived + ('goals',))


def _states_of_drive(drive: Movement) -> List[Tuple[float, str]]:
    """Returns (begin [s], state) of each state of a drive."""
    begins = [drive.begin]
    if drive.forward < drive.turns_again:
        begins.append(drive.forward)
        if drive.turns_again < drive.end:
            begins.append(drive.turns_again)
    return list(zip(begins, DRIVING))
