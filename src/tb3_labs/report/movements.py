"""The movements of a run, found in its commands alone: for nodes that say nothing of themselves.

A *movement* is a stretch of commands that are not zero, with pauses shorter than `PAUSE`. A reset,
and a change of `ctrl_relinq`, end a movement and begin the next. It is a

* turn, if no command has a forward speed;
* drive, if a turn, a straight line and a turn were commanded; one turn may be missing. The
  line is straight if the heading stays within `KEPT` of its first value;
* movement by hand, if it is neither.

The commands do not name their sender, so other topics decide if they can:

* With ctrl_relinq, a movement while a node has control is a drive, and any other movement is by
  hand. A turn alone is a drive only if a reset, a change of control or the end of the recording cut
  it off: else a person turned the robot while the node was silent at its goal. With `joy` alone the
  pad never gave control, and all is by hand.
* With `mouse_info`, nothing is a drive, and a turn is faster than any that the mouse commands.

Otherwise a person who turns, drives straight on and turns, by keys, counts as a drive.

`completed` adds to the run of a node that publishes `cmd_vel` and nothing else the rest that the
package's own nodes would have published. It follows from the sensors:

* the robot's pose in ``local``, and ``local`` in ``odom``: declared (0, 0, 0) at the first sample,
  then by each reset; place by the odometry without its jumps, heading by the IMU. It is the pose by
  the lab's theory, not the one that the node may believe;
* the states of a drive and its goal: by the movements that the commands show.

Units: metres, radians, seconds since the recording's start.
Edge cases: a command is in force until the next one, at most for the robot's timeout. A run without
commands has no movements.
"""
import math
from dataclasses import dataclass, replace
from enum import Enum
from typing import List, Sequence, Tuple

import numpy as np

from tb3_labs.control.goal import DRIVING
from tb3_labs.geometry.angles import wrap_all
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.localization.odometry_jumps import POSE_LOST
from tb3_labs.report.epochs import robot_in_odom, steady_odometry
from tb3_labs.report.run_data import Poses, RunData, States
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT

#: A longer time without a command that moves the robot ends a movement [s].
PAUSE = 1.0
#: A command that is slower than this is zero [m/s], [rad/s].
NO_SPEED = 1e-3
#: On a straight line the heading differs from that at its begin by no more than this [rad], counted
#: from this time after its begin, when the turn before is over [s].
KEPT = math.radians(20.0)
TURN_IS_OVER = 0.3
#: A drive moves the robot at least this far [m].
SHORTEST_DRIVE = 0.1
#: The mouse commands no faster turn than this [rad/s], by the handout.
FASTEST_BY_MOUSE = 0.5
#: The goal of the lab: x, y [m], heading [rad].
LAB_GOAL = Pose2(-0.61, 0.61, 0.0)
#: States after a drive that was found: it ended by itself, or because another one took control.
RESTED, TAKEN = 'came to rest', 'control was taken'
#: Control was taken at this time from the last command, or nearer [s].
TAKEN_WITHIN = 0.3


class Kind(Enum):
    """The kinds of movements."""

    TURN = 'turn'
    DRIVE = 'drive'
    BY_HAND = 'by hand'


@dataclass(frozen=True)
class Movement:
    """A movement from `begin` to `end`; its commands go forward from `forward` to `turns_again`,
    or never, if both are equal."""

    kind: Kind
    begin: float
    forward: float
    turns_again: float
    end: float


def movements(run: RunData) -> List[Movement]:
    """All movements of a run, in order."""
    time = run.commands.time
    moves = np.flatnonzero((np.abs(run.commands.linear) > NO_SPEED)
                           | (np.abs(run.commands.angular) > NO_SPEED))
    if not len(moves):
        return []
    ends = np.minimum(np.append(time[1:], np.inf), time + COMMAND_TIMEOUT)
    changes = np.flatnonzero(np.diff(run.control.value)) + 1
    cuts = np.sort(np.concatenate([run.resets.time, run.control.time[changes]]))
    is_cut = np.searchsorted(cuts, time[moves[:-1]]) < np.searchsorted(cuts, time[moves[1:]])
    is_pause = time[moves[1:]] - ends[moves[:-1]] >= PAUSE
    return [_movement(run, part, ends, cuts)
            for part in np.split(moves, np.flatnonzero(is_cut | is_pause) + 1)]


def _movement(run: RunData, moves: np.ndarray, ends: np.ndarray, cuts: np.ndarray) -> Movement:
    """The Movement of the commands with the indices `moves`, in force until `ends` [s]; one near a
    time of `cuts` [s] did not end by itself."""
    time = run.commands.time
    begin, end = float(time[moves[0]]), float(min(ends[moves[-1]], run.duration))
    forward = turns_again = end
    ahead = moves[np.abs(run.commands.linear[moves]) > NO_SPEED]
    if len(ahead):
        forward, turns_again = float(time[ahead[0]]), float(min(ends[ahead[-1]], end))
    kind = Kind.BY_HAND
    if len(run.control) or 'joy' in run.devices:
        cut_off = end == run.duration or (np.abs(cuts - end) <= COMMAND_TIMEOUT).any()
        if (len(ahead) or cut_off) and _has_control(run, (begin + end) / 2.0):
            kind = Kind.DRIVE
    elif len(ahead):
        has_turn = moves[0] < ahead[0] or moves[-1] > ahead[-1]
        if has_turn and 'mouse_info' not in run.devices and _is_line(run, forward, turns_again):
            kind = Kind.DRIVE
    elif 'mouse_info' not in run.devices or (
            np.abs(run.commands.angular[moves]).max() > FASTEST_BY_MOUSE + NO_SPEED):
        kind = Kind.TURN
    return Movement(kind, begin, forward, turns_again, end)


def by_hand(run: RunData, listed: Sequence[Tuple[float, float]]) -> List[Movement]:
    """The movements that overlap none of the turns and drives, (begin, end), that are `listed`."""
    return [movement for movement in movements(run) if not any(
        movement.begin < end and begin < movement.end for begin, end in listed)]


def _has_control(run: RunData, time: float) -> bool:
    """Had a node control at this time? Before the first message it was the other way."""
    if not len(run.control):
        return False
    heard = int(np.searchsorted(run.control.time, time, side='right'))
    return bool(run.control.value[heard - 1]) if heard else not run.control.value[0]


def _is_line(run: RunData, begin: float, end: float) -> bool:
    """Did the robot move, and keep its heading, from `begin` to `end` [s]?"""
    yaw = np.unwrap(run.imu.between(begin + TURN_IS_OVER, end).yaw)
    return (not len(yaw) or bool(np.abs(yaw - yaw[0]).max() <= KEPT)) and (
        run.odometry.at(begin).distance_to(run.odometry.at(end)) >= SHORTEST_DRIVE)


def completed(run: RunData, goal: Pose2 = LAB_GOAL) -> RunData:
    """The run, with local_pose, frames, states and goals if these were not recorded.

    `goal` is that of each drive. Those fields are named in `derived`.
    """
    if not len(run.local_pose) and len(run.frames):
        local = run.frames.inverse() @ robot_in_odom(run, run.frames.time)
        run = replace(run, local_pose=local, derived=run.derived + ('local_pose',))
    elif not len(run.local_pose):
        run = _with_local(run)
    return run if len(run.states) else _with_states(run, goal)


def _with_local(run: RunData) -> RunData:
    steady, _, jumps = steady_odometry(run.odometry, run.imu)
    declared = [(float(steady.time[0]), Pose2())] + [
        (time, Pose2()) for time, jump in jumps if jump.outcome == POSE_LOST]
    declared += [(float(run.resets.time[k]), run.resets.pose(k)) for k in range(len(run.resets))]
    declared.sort(key=lambda reset: reset[0])
    frames = [(time, steady.at(time) @ local_T_base.inverse(), local_T_base.yaw)
              for time, local_T_base in declared]
    number = np.searchsorted([time for time, _ in declared], steady.time, side='right') - 1
    x, y, yaw, imu_yaw = np.array([
        (frame.x, frame.y, frame.yaw, float(run.imu.yaw_at(time)) - declared_yaw)
        for time, frame, declared_yaw in frames])[number.clip(0)].T
    steady_T_local = Poses(steady.arrival, steady.time, x, y, yaw)
    local = steady_T_local.inverse() @ steady
    heading = wrap_all(run.imu.yaw_at(steady.time) - imu_yaw)
    return replace(
        run, local_pose=replace(local, yaw=heading), derived=run.derived + ('local_pose', 'frames'),
        frames=run.odometry @ steady.inverse() @ steady_T_local)


def _with_states(run: RunData, goal: Pose2) -> RunData:
    begins: List[Tuple[float, str]] = []
    taken = run.control.time[run.control.value == 0.0]
    drives = [movement for movement in movements(run) if movement.kind is Kind.DRIVE]
    next_begins = [drive.begin for drive in drives[1:]] + [math.inf]
    for drive, next_begin in zip(drives, next_begins):
        begins += _states(drive)
        was_reset = len(run.resets.between(drive.end - COMMAND_TIMEOUT, drive.end)) > 0
        if drive.end < run.duration and not (was_reset and next_begin < drive.end + PAUSE):
            was_taken = (np.abs(taken - drive.end) < TAKEN_WITHIN).any()
            begins.append((drive.end, TAKEN if was_taken else RESTED))
    if not begins:
        return run
    time = np.array([begin for begin, _ in begins])
    words = np.array([word for _, word in begins], dtype=object)
    goals = run.goals if len(run.goals) else Poses(
        time, time, *(value + 0.0 * time for value in (goal.x, goal.y, goal.yaw)))
    return replace(run, states=States(time, time, words), goals=goals, derived=run.derived + (
        ('states',) if goals is run.goals else ('states', 'goals')))


def _states(drive: Movement) -> List[Tuple[float, str]]:
    """The states of a drive, each with its begin."""
    begins = [drive.begin]
    if drive.forward < drive.turns_again:
        begins.append(drive.forward)
        if drive.turns_again < drive.end:
            begins.append(drive.turns_again)
    return list(zip(begins, DRIVING))
