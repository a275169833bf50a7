"""The start settings of move_to_goal, the status of a drive, and the log lines about a drive."""
import math
from dataclasses import dataclass
from typing import Callable, NamedTuple, Optional, Sequence, Tuple

from tb3_labs.config import Config, setting
from tb3_labs.control.goal_state import (
    DRIVING, GAVE_UP, STOPPED, WAITING, WAITING_FOR_CONTROL, GoalState, is_stopped)
from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.handout import GOAL_X, GOAL_Y, GOAL_YAW_DEG, PRINTED_REACHED
from tb3_labs.localization.localizer import StampedPose
from tb3_labs.robot.samples import Motion
from tb3_labs.supervision.events import LogQueue, Output
from tb3_labs.supervision.goal_requests import (
    MAX_COORDINATE, MAX_YAW_DEG, GoalAnswer, TypedPose)


@dataclass(frozen=True)
class MoveToGoalConfig(Config):
    """The settings with which `move_to_goal` starts."""

    goal_x: float = setting(float(GOAL_X), 'first goal, in the local frame', 'm',
                            -MAX_COORDINATE, MAX_COORDINATE)
    goal_y: float = setting(float(GOAL_Y), 'first goal, in the local frame', 'm',
                            -MAX_COORDINATE, MAX_COORDINATE)
    goal_yaw_deg: float = setting(float(GOAL_YAW_DEG), 'heading at the first goal', 'deg',
                                  -MAX_YAW_DEG, MAX_YAW_DEG)
    has_control: bool = setting(False, 'may drive from the start; typed, not in a file')

    @property
    def goal(self) -> Pose2:
        return TypedPose(self.goal_x, self.goal_y, self.goal_yaw_deg).pose


class DriveStatus(NamedTuple):
    """The status of a drive at one moment, for the user."""

    state: GoalState
    goal: Optional[Pose2]         # in local
    distance_tolerance: float     # [m]
    attempt: int                  # number of drives that have begun so far, for any goal
    has_begun: bool               # a motion was commanded in this drive
    is_active: bool               # the goal is neither reached nor given up
    failure: str                  # the reason why the drive was given up, or ''
    reason_to_stand: str          # the reason why the robot must stand now, or ''
    may_drive: bool               # the node may drive
    sensor_problem: str           # a text about lost sensors, or readings that disagree, or ''

    def remaining(self, motion: Optional[Motion]) -> Tuple[float, float]:
        """Returns the distance [m] to the goal, and the angle [deg, >= 0] to the goal's heading."""
        assert self.goal is not None and motion is not None
        turn = difference(self.goal.yaw, motion.pose.yaw)
        return motion.pose.distance_to(self.goal), abs(math.degrees(turn))

    @property
    def text(self) -> str:
        """The text on `goal_state`; '' while the drive is about to begin."""
        if self.failure:
            return f'{GAVE_UP}: {self.failure}'
        if not self.is_active:
            return self.state.name
        if not self.may_drive:
            return WAITING_FOR_CONTROL
        if not self.has_begun:
            return f'{WAITING}: {self.sensor_problem}' if self.sensor_problem else ''
        return f'{STOPPED}: {self.reason_to_stand}' if self.reason_to_stand else self.state.name


@dataclass(frozen=True)
class DriveOutput(Output):
    """The decision of a MoveToGoalCore."""

    #: Control was given and not taken back. A short silence of the sender does not end control.
    has_control: bool = False
    answers: Sequence[GoalAnswer] = ()            # to send to the goals' clients, in order
    status: Optional[DriveStatus] = None          # None if the status has not changed
    stamped_pose: Optional[StampedPose] = None    # None if there is no new pose
    odom_T_local: Optional[Pose2] = None          # None before the first StampedPose

    @property
    def has_other_work(self) -> bool:
        return bool(self.log_lines or self.answers or self.status)


class StatusLogger:
    """Logs each change in the status of a drive for the user."""

    def __init__(self, log: LogQueue) -> None:
        self._log = log
        self._logged_key: Tuple = ()    # attempt, goal and text of the last status that was logged
        self._begun_attempt = 0         # number of the latest drive that began
        self._begun_at = 0.0            # time [s] at which this drive began

    def log_if_new(self, status: DriveStatus, motion: Callable[[], Optional[Motion]],
                   now: float) -> bool:
        """Returns False if `status` is not new. Otherwise, logs `status` and returns True.
        `motion()` returns the current Motion."""
        status_key = (status.attempt, status.goal, status.text)
        if not status.text or status_key == self._logged_key:
            return False
        self._logged_key = status_key
        has_just_begun = status.has_begun and status.attempt != self._begun_attempt
        if has_just_begun:
            self._begun_attempt = status.attempt
            self._begun_at = now
        self._log_status(status, motion, has_just_begun, now)
        return True

    def _log_status(self, status: DriveStatus, motion: Callable[[], Optional[Motion]],
                    has_just_begun: bool, now: float) -> None:
        if status.failure:
            self._log.warn(f'Goal ({status.goal}) given up: {status.failure}')
        elif not status.is_active:
            distance, angle = status.remaining(motion())
            self._log.add(f'{PRINTED_REACHED}! {distance:.3f} m and {angle:.1f} deg off, '
                          f'after {now - self._begun_at:.1f} s')
        elif status.text in DRIVING:
            if has_just_begun:
                distance, angle = status.remaining(motion())
                self._log.add(f'Goal ({status.goal}): {distance:.3f} m to go, {angle:.1f} deg off '
                              'the final heading')
            self._log.add(status.text)
        elif is_stopped(status.text):
            self._log.warn(status.text.capitalize())
        else:
            remedy = ' (True on ctrl_relinq)' if status.text == WAITING_FOR_CONTROL else ''
            self._log.add(f'Goal ({status.goal}): {status.text}{remedy}')
