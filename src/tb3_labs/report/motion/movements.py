"""Finds the movements of a run by its commands, for nodes that do not publish their state.

A *movement* is a stretch of commands that are not zero. Its pauses are shorter than
`MOVEMENT_PAUSE`. A reset, or a change of `ctrl_relinq`, divides a movement in two. A movement is a

* turn, if no command has a forward speed;
* drive, if a turn, a straight line and a turn were commanded; one of both turns may be missing. The
  line is straight if the heading stays within `MOST_BEND` of the heading at the line's start;
* movement by hand, if it is not a turn and not a drive.

The commands do not name their sender. Other topics help to find it if they were recorded:

* With `ctrl_relinq`, a movement while a node has control is a drive, and any other movement is by
  hand. A turn without a line is a drive in two cases: a reset or a change of control came right
  before the turn; or a reset, a change of control or the end of the recording cut the turn off.
  Any other turn is by hand: a person turned the robot while the node was silent at its goal.
* With `joy` and without `ctrl_relinq`, the pad never gave control, and all movements are by hand.
* With `mouse_info`, no movement is a drive, and a turn must be faster than the mouse can command.

Without these topics, turns and a straight line that a person drives by keys look like a drive.

A node may publish only `cmd_vel`. Then `completed` adds the topics that the package's own nodes
publish. The states and the goals of drives are found by the movements. The robot's pose in
``local`` is (0, 0, 0) at the first sample, and the declared pose at a reset. As in the lab, its
place follows the odometry without the odometry's jumps, and its heading follows the IMU. If the
board restarts in motion, the pose is unknown until the next reset. The node itself may believe
another pose.

Units: metres, radians, seconds since the recording's start.
Edge cases: a command is in force until the next command, at most for the robot's timeout. A run
without commands has no movements.
"""
import math
import re
from dataclasses import dataclass, replace
from enum import Enum
from typing import List, Tuple

import numpy as np

from tb3_labs.control.goal_state import DRIVING
from tb3_labs.geometry.angle_arrays import wrap_all
from tb3_labs.geometry.se2 import Pose2, TypedPose
from tb3_labs.geometry.sorted_times import last_before, last_until
from tb3_labs.handout import GOAL_X, GOAL_Y, GOAL_YAW_DEG, MOUSE_FULL
from tb3_labs.localization.odometry_jumps import POSE_LOST, JumpFinder
from tb3_labs.localization.sample_timing import SampleTiming
from tb3_labs.report.motion.resets_and_goals import robot_in_odom
from tb3_labs.report.run_data import Commands, Poses, RunData, States, cached_per_run
from tb3_labs.robot.samples import ImuSample, OdometrySample
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT
from tb3_labs.supervision.timeouts import RESET_SILENCE

#: A movement ends if no command moves the robot for this time [s].
MOVEMENT_PAUSE = 1.0
#: The names of programs by which a person drives.
PERSONS_PROGRAM = re.compile('teleop|joy|pad|mouse|key|rqt_|rviz|panel')
#: The program that sends commands which a person types in a terminal.
TERMINAL = 'rostopic pub'
#: A part of a movement by hand is joined to the part before it if it is shorter than this [s].
SHORTEST_PART = 0.4
#: At most this many movements of a run are found.
MOST_MOVEMENTS = 1000
#: A speed below this counts as zero [m/s], [rad/s].
NO_SPEED = 1e-3
#: On a straight line the heading differs by at most this from the heading at the line's start
#: [rad].
MOST_BEND = math.radians(20.0)
#: The turn before a straight line may go on for this time after the line's first command [s].
STRAIGHT_AFTER = 0.3
#: A drive moves the robot at least this far [m].
SHORTEST_DRIVE = 0.1
LAB_GOAL = TypedPose(GOAL_X, GOAL_Y, GOAL_YAW_DEG).pose
#: A drive is followed by one of these states: the robot came to rest, or the node lost control.
CAME_TO_REST, CONTROL_GONE = 'came to rest', 'control was taken'
#: The loss of control ended a drive if both came within this time [s].
TAKEN_WITHIN = 0.3


class MovementKind(Enum):
    TURN = 'turn'
    DRIVE = 'drive'
    BY_HAND = 'by hand'


@dataclass(frozen=True)
class Movement:
    """A movement from `begin` to `end`. Its commands have a forward speed from `forward` to
    `turns_again`, or never if both times are equal."""

    kind: MovementKind
    begin: float
    forward: float
    turns_again: float
    end: float


def moving(commands: Commands) -> np.ndarray:
    """Returns for each command whether it moves the robot."""
    return (np.abs(commands.linear) > NO_SPEED) | (np.abs(commands.angular) > NO_SPEED)


def programs(run: RunData, begin: float, end: float) -> List[str]:
    """Returns the names of the programs that commanded the robot from `begin` to `end` [s]. Unknown
    programs, and programs by which a person drives, are left out."""
    names = {run.senders[int(k)] for k in run.sender_index.between(begin, end).value}
    return sorted(TERMINAL if '/rostopic_' in name else name for name in names
                  if name != '?' and not PERSONS_PROGRAM.search(name))


def parts_of(run: RunData, movement: Movement) -> List[Tuple[float, float]]:
    """Returns (begin, end) of the parts of a movement by hand [s]. In each part, the robot only
    drives, or only turns on the spot."""
    commands = run.commands.between(movement.begin, movement.end)
    commands = commands.take(moving(commands))
    is_ahead = np.abs(commands.linear) > NO_SPEED
    begins = [movement.begin]
    for k in np.flatnonzero(is_ahead[1:] != is_ahead[:-1]) + 1:
        later = np.flatnonzero(is_ahead[k:] != is_ahead[k])
        until = commands.time[k + later[0]] if len(later) else movement.end
        begin = float(commands.time[k])
        if min(until - begin, begin - begins[-1]) > SHORTEST_PART:
            begins.append(begin)
    return list(zip(begins, begins[1:] + [movement.end]))[:MOST_MOVEMENTS]


@cached_per_run
def movements(run: RunData) -> List[Movement]:
    time = run.commands.time
    moves = np.flatnonzero(moving(run.commands))
    if not len(moves):
        return []
    ends = np.minimum(np.append(time[1:], np.inf), time + COMMAND_TIMEOUT)
    cut = cuts(run)
    is_cut = np.searchsorted(cut, time[moves[:-1]]) < np.searchsorted(cut, time[moves[1:]])
    is_pause = time[moves[1:]] - ends[moves[:-1]] >= MOVEMENT_PAUSE
    return [_movement(run, part, ends, cut)
            for part in np.split(moves, np.flatnonzero(is_cut | is_pause) + 1)[:MOST_MOVEMENTS]]


def cuts(run: RunData) -> np.ndarray:
    """Returns the times at which a reset or a change of control cuts off a movement [s].

    If a node gets control within MOVEMENT_PAUSE after a movement began, the node began this
    movement, because it received ctrl_relinq before the recorder did. Then nothing is cut.
    """
    changes = np.flatnonzero(np.diff(run.control.value)) + 1
    times, is_given = run.control.time[changes], run.control.value[changes] == 1.0
    moves = run.commands.time[moving(run.commands)]
    begins = moves[np.diff(moves, prepend=-np.inf) >= MOVEMENT_PAUSE]
    last_begin = np.append(begins, -math.inf)[last_before(begins, times)]
    is_nodes_begin = is_given & (times - last_begin < MOVEMENT_PAUSE)
    return np.sort(np.concatenate([run.resets.time, times[~is_nodes_begin]]))


def _movement(run: RunData, moves: np.ndarray, ends: np.ndarray, cut: np.ndarray) -> Movement:
    """Returns the Movement of the commands with the indices `moves`. `ends` has the time at which
    each command of the run ends [s]. `cut` has the times of :func:`cuts`."""
    time = run.commands.time
    begin, end = float(time[moves[0]]), float(min(ends[moves[-1]], run.duration))
    forward = turns_again = end
    ahead = moves[np.abs(run.commands.linear[moves]) > NO_SPEED]
    if len(ahead):
        forward, turns_again = float(time[ahead[0]]), float(min(ends[ahead[-1]], end))
    kind = MovementKind.BY_HAND
    if len(run.control) or 'joy' in run.devices:
        was_cut_off = end == run.duration or (np.abs(cut - end) <= COMMAND_TIMEOUT).any()
        follows_cut = ((cut <= begin) & (begin - cut < MOVEMENT_PAUSE)).any()
        if (len(ahead) or was_cut_off or follows_cut) and has_control(run, (begin + end) / 2.0):
            kind = MovementKind.DRIVE
    elif len(ahead):
        has_turn = moves[0] < ahead[0] or moves[-1] > ahead[-1]
        if has_turn and 'mouse_info' not in run.devices and _is_line(run, forward, turns_again):
            kind = MovementKind.DRIVE
    elif 'mouse_info' not in run.devices or (
            np.abs(run.commands.angular[moves]).max() > MOUSE_FULL + NO_SPEED):
        kind = MovementKind.TURN
    return Movement(kind, begin, forward, turns_again, end)


def has_control(run: RunData, time: float) -> bool:
    """Did a node have control at this time [s]? Before the first message on ctrl_relinq, the answer
    is the opposite of this message."""
    if not len(run.control):
        return False
    before = run.control.value[run.control.time <= time]
    return bool(before[-1]) if len(before) else not run.control.value[0]


def _is_line(run: RunData, begin: float, end: float) -> bool:
    """Was the way from `begin` to `end` [s] straight, and long enough for a drive?"""
    yaw = np.unwrap(run.imu.between(begin + STRAIGHT_AFTER, end).yaw)
    if len(yaw) and np.abs(yaw - yaw[0]).max() > MOST_BEND:
        return False
    return run.odometry.at(begin).distance_to(run.odometry.at(end)) >= SHORTEST_DRIVE


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
    continuous, lost = _continuous_odometry(run)
    declared = sorted([(float(continuous.time[0]), Pose2())] + [
        (float(time), run.resets.pose(k)) for k, time in enumerate(run.resets.time)],
        key=lambda reset: reset[0])
    begins = np.array([time for time, _ in declared])
    frames = []
    for time, local_T_base in declared:
        frame = continuous.at(time) @ local_T_base.inverse()
        frames.append((frame.x, frame.y, frame.yaw,
                       float(run.imu.yaw_at(time)) - local_T_base.yaw))
    number = last_until(begins, continuous.time)
    x, y, yaw, imu_yaw = np.array(frames)[number.clip(0)].T
    continuous_T_local = Poses(continuous.arrival, continuous.time, x, y, yaw)
    local = continuous_T_local.inverse() @ continuous
    heading = wrap_all(run.imu.yaw_at(continuous.time) - imu_yaw)
    is_known = np.ones(len(continuous), dtype=bool)
    for time in lost:
        next_reset = min(begins[begins > time], default=math.inf)
        is_known &= (continuous.time < time) | (continuous.time >= next_reset)
    return replace(
        run, local_pose=replace(local, yaw=heading).take(is_known),
        frames=run.odometry @ continuous.inverse() @ continuous_T_local,
        derived=run.derived + ('local_pose', 'frames'))


def _continuous_odometry(run: RunData) -> Tuple[Poses, List[float]]:
    """Returns (the odometry without its jumps, the times at which the pose is lost [s]). The jumps
    are found as in move_to_goal."""
    odometry, imu = run.odometry, run.imu
    jumps, timing, first_T_odom, poses, lost = JumpFinder(), SampleTiming(), Pose2(), [], []
    newest = last_until(imu.arrival, odometry.arrival)
    for k, index in enumerate(newest.clip(0)):
        if odometry.arrival[k] - imu.arrival[index] > RESET_SILENCE:
            index = min(index + 1, len(imu) - 1)    # the IMU was silent before this sample
        shift, jump = jumps.find(
            timing.on_odometry(OdometrySample(
                odometry.time[k], odometry.pose(k), float(odometry.linear[k]),
                float(odometry.angular[k])), odometry.arrival[k]),
            ImuSample(imu.time[index], imu.yaw[index], imu.yaw_rate[index]))
        if shift is not None:
            first_T_odom = first_T_odom @ shift.inverse()
        if jump is not None and jump.outcome == POSE_LOST:
            first_T_odom = Pose2()
            lost.append(float(odometry.time[k]))
        pose = first_T_odom @ odometry.pose(k)
        poses.append((pose.x, pose.y, pose.yaw))
    return Poses(odometry.arrival, odometry.time, *np.array(poses).T), lost


def _with_states(run: RunData, goal: Pose2) -> RunData:
    begins: List[Tuple[float, str]] = []
    taken = run.control.time[run.control.value == 0.0]
    drives = [movement for movement in movements(run) if movement.kind is MovementKind.DRIVE]
    next_begins = [drive.begin for drive in drives[1:]] + [math.inf]
    for drive, next_begin in zip(drives, next_begins):
        begins += _states_of_drive(drive)
        was_reset = len(run.resets.between(drive.end - COMMAND_TIMEOUT, drive.end)) > 0
        goes_on = was_reset and next_begin < drive.end + MOVEMENT_PAUSE
        if drive.end < run.duration and not goes_on:
            was_taken = (np.abs(taken - drive.end) < TAKEN_WITHIN).any()
            begins.append((drive.end, CONTROL_GONE if was_taken else CAME_TO_REST))
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
