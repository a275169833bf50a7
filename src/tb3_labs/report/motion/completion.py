"""Computes the poses, states and goals of a run whose node publishes only `cmd_vel`.

`completed` adds the topics that the package's own nodes publish. The states and the goals of drives
are found by the movements. The robot's pose in ``local`` is (0, 0, 0) at the first sample, and the
declared pose at a reset. As in the lab, its place follows the odometry without the odometry's
jumps, and its heading follows the IMU. If the board restarts in motion, the pose is unknown until
the next reset. The node itself may believe another pose.

Units: metres, radians, seconds since the recording's start.
"""
import math
from dataclasses import replace
from typing import List, Tuple

import numpy as np

from tb3_labs.control.goal_state import DRIVING
from tb3_labs.geometry.arrays import last_until, wrap_all
from tb3_labs.geometry.se2 import Pose2, TypedPose
from tb3_labs.handout import GOAL_X, GOAL_Y, GOAL_YAW_DEG
from tb3_labs.localization.odometry_jumps import POSE_LOST, JumpFinder
from tb3_labs.localization.sample_timing import SampleTiming
from tb3_labs.report.motion.movements import MOVEMENT_PAUSE, Movement, MovementKind, movements
from tb3_labs.report.motion.resets_and_goals import robot_in_odom
from tb3_labs.report.run_data import Poses, RunData, States
from tb3_labs.robot.samples import ImuSample, OdometrySample
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT
from tb3_labs.supervision.timeouts import RESET_SILENCE

LAB_GOAL = TypedPose(GOAL_X, GOAL_Y, GOAL_YAW_DEG).pose
#: A drive is followed by one of these states: the robot came to rest, or the node lost control.
CAME_TO_REST, CONTROL_GONE = 'came to rest', 'control was taken'
#: The loss of control ended a drive if it came within this time before or after its end [s].
TAKEN_WITHIN = 0.3


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
    declared = [(float(continuous.time[0]), Pose2())]
    declared += [(float(time), run.resets.pose(k)) for k, time in enumerate(run.resets.time)]
    declared.sort(key=lambda reset: reset[0])
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
    jumps = JumpFinder()
    timing = SampleTiming()
    first_T_odom = Pose2()
    poses, lost = [], []
    newest = last_until(imu.arrival, odometry.arrival)
    for k, index in enumerate(newest.clip(0)):
        if odometry.arrival[k] - imu.arrival[index] > RESET_SILENCE:
            index = min(index + 1, len(imu) - 1)    # the IMU was silent before this sample
        sample = OdometrySample(odometry.time[k], odometry.pose(k), float(odometry.linear[k]),
                                float(odometry.angular[k]))
        shift, jump = jumps.find(
            timing.on_odometry(sample, odometry.arrival[k]),
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
