"""A run with all that the package's own nodes would have published, where its nodes did not.

A student's node publishes `cmd_vel` and nothing else. The rest follows from the sensors:

* the robot's pose in ``local``, and ``local`` in ``odom``: declared (0, 0, 0) at the first sample,
  then by each reset; place by the odometry without its jumps, heading by the IMU. It is the pose by
  the lab's theory, not the one that the node may believe;
* the states of a drive and its goal: by the movements that the commands show.

Units: metres, radians, seconds since the recording's start.
"""
import math
from dataclasses import replace
from typing import List, Tuple

import numpy as np

from tb3_labs.geometry.angles import wrap_all
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.localization.odometry_jumps import POSE_LOST
from tb3_labs.report.analysis import FIRST, LAST, STRAIGHT
from tb3_labs.report.epochs import between, declared_frame, steady_odometry
from tb3_labs.report.movements import PAUSE, Kind, Movement, movements
from tb3_labs.report.run_data import Poses, RunData, States
from tb3_labs.report.sensors import imu_yaw_at
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT

#: The goal of the lab: x, y [m], heading [rad].
LAB_GOAL = Pose2(-0.61, 0.61, 0.0)
#: States after a drive that was found: it ended by itself, or because another one took control.
RESTED, TAKEN = 'came to rest', 'control was taken'
#: Control was taken at this time from the last command, or nearer [s].
TAKEN_WITHIN = 0.3


def completed(run: RunData, goal: Pose2 = LAB_GOAL) -> RunData:
    """The run, with local_pose, frames, states and goals where they were not recorded.

    `goal` is that of each drive. Those fields are named in `derived`.
    """
    if not len(run.local_pose) and not len(run.frames):
        run = _with_local(run)
    return run if len(run.states) else _with_states(run, goal)


def _with_local(run: RunData) -> RunData:
    steady, _, jumps = steady_odometry(run.odometry, run.imu)
    declared = [(float(steady.time[0]), Pose2())] + [
        (time, Pose2()) for time, jump in jumps if jump.outcome == POSE_LOST]
    declared += [(float(run.resets.time[k]), run.resets.pose(k)) for k in range(len(run.resets))]
    declared.sort(key=lambda reset: reset[0])
    frames = [declared_frame(run, steady, *reset) for reset in declared]
    number = np.searchsorted([time for time, _ in declared], steady.time, side='right') - 1
    x, y, yaw, imu_yaw = np.array([
        (frame.odom_T_local.x, frame.odom_T_local.y, frame.odom_T_local.yaw, frame.imu_yaw_of_x)
        for frame in frames])[number.clip(0)].T
    steady_T_local = Poses(steady.arrival, steady.time, x, y, yaw)
    local = steady_T_local.inverse() @ steady
    heading = wrap_all(imu_yaw_at(run, steady.time) - imu_yaw)
    return replace(
        run, local_pose=replace(local, yaw=heading), derived=run.derived + ('local_pose', 'frames'),
        frames=run.odometry @ steady.inverse() @ steady_T_local)


def _with_states(run: RunData, goal: Pose2) -> RunData:
    begins: List[Tuple[float, str]] = []
    drives = [movement for movement in movements(run) if movement.kind is Kind.DRIVE]
    next_begins = [drive.begin for drive in drives[1:]] + [math.inf]
    for drive, next_begin in zip(drives, next_begins):
        begins += _states(drive)
        was_reset = len(between(run.resets, drive.end - COMMAND_TIMEOUT, drive.end)) > 0
        if drive.end < run.duration and not (was_reset and next_begin < drive.end + PAUSE):
            begins.append((drive.end, _after(run, drive)))
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
    states = [(drive.begin, FIRST)]
    if drive.forward < drive.turns_again:
        states.append((drive.forward, STRAIGHT))
        if drive.turns_again < drive.end:
            states.append((drive.turns_again, LAST))
    return states


def _after(run: RunData, drive: Movement) -> str:
    """The state after a drive."""
    taken = run.control.time[run.control.value == 0.0]
    return TAKEN if (np.abs(taken - drive.end) < TAKEN_WITHIN).any() else RESTED
