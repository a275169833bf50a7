"""Drives to a goal in the four states of :class:`tb3_labs.control.goal_state.GoalState`.

The law, :mod:`tb3_labs.control.drive_law`, gives the command in each driving state and decides
when a state is finished. This module chooses the next state. A drive is given up if the robot gets
no nearer to its goal. The goal is reached when the robot has settled, and a later sample shows the
robot at the goal. After GOAL_REACHED or a failure the command is None.

Units: metres, radians, seconds. Poses are in the local frame.
"""
from collections import defaultdict
from typing import Dict, Optional

from tb3_labs.control.commands import LawStep
from tb3_labs.control.drive_law import DriveLaw
from tb3_labs.control.goal_state import GoalState
from tb3_labs.control.turning import Settling
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.samples import Motion, is_at_rest
from tb3_labs.robot.turtlebot3 import Twist2
from tb3_labs.supervision.motion_monitors import StallMonitor

MAX_RETRIES = 2    # a drive that ends outside its tolerance is repeated at most this often


class GoalMachine:
    def __init__(self, law: DriveLaw) -> None:
        self.law = law
        self.goal: Optional[Pose2] = None
        self.state = GoalState.GOAL_REACHED    # no goal was set, so no drive is active
        self.failure = ''         # the reason why the drive was given up, or ''
        self.has_begun = False    # a motion to this goal was commanded
        self.is_canceled = False  # a person or program has canceled the drive
        self.attempt = 0          # number of drives so far
        self._retries_left = 0
        self._law_is_started = False
        self._stalls: Dict[GoalState, StallMonitor] = defaultdict(StallMonitor)
        self._settling = Settling()
        self._time = 0.0             # sum [s] of all `dt`

    @property
    def is_active(self) -> bool:
        return self.state is not GoalState.GOAL_REACHED and not self.failure

    def set_goal(self, goal: Pose2) -> None:
        self.goal = goal
        self.is_canceled = False
        self.begin_drive()

    def begin_drive(self) -> None:
        """Begin the drive to the goal again, unless the drive was canceled."""
        if self.goal is not None and not self.is_canceled:
            self.failure = ''
            self.has_begun = False
            self.attempt += 1
            self._retries_left = MAX_RETRIES
            self._reset_states()

    def restart_law(self) -> None:
        """Let the next step drive to the goal from a new pose, because the robot was stopped."""
        self._law_is_started = False

    def give_up(self, failure: str) -> None:
        """End the drive before the goal is reached."""
        self.failure = failure

    def cancel(self) -> None:
        """End the drive. The next drive needs a new goal."""
        if self.goal is not None:
            self.is_canceled = True
            self.give_up('canceled')

    def step(self, motion: Motion, dt: float) -> Optional[Twist2]:
        """Returns the command; None if no drive is active. The previous step was `dt` [s] ago."""
        self._time += dt
        is_resting = is_at_rest(motion.linear, motion.angular)
        self._settling.update(is_resting, measured_at=self._time - motion.imu_age)
        return self._next_command(motion, is_resting, dt)

    def _next_command(self, motion: Motion, is_resting: bool, dt: float) -> Optional[Twist2]:
        goal = self.goal
        if goal is None or not self.is_active:
            return None
        if not self._law_is_started:
            self._start_law(motion.pose, goal)
        step = self._step_law(motion, goal, dt)
        if step.is_finished:
            if self.state is GoalState.ROTATE_TO_FINAL and not self._has_settled(motion):
                return Twist2()
            self._finish_state(motion.pose, goal)
            return self._next_command(motion, is_resting, dt=0.0)    # in the next state
        self.failure = self._stalls[self.state].update(
            step.remaining, is_resting, dt, must_move=step.command != Twist2())
        return None if self.failure else step.command

    def _start_law(self, pose: Pose2, goal: Pose2) -> None:
        for stall in self._stalls.values():
            stall.forget_least_remaining()
        self.has_begun = True
        self._law_is_started = True
        self.state = GoalState.ROTATE_TO_GOAL
        self.law.start(pose, goal)

    def _step_law(self, motion: Motion, goal: Pose2, dt: float) -> LawStep:
        if self.state is GoalState.ROTATE_TO_GOAL:
            return self.law.rotate_to_goal(motion, goal, dt)
        if self.state is GoalState.MOVE_FORWARD:
            return self.law.move_forward(motion, goal, dt)
        return self.law.rotate_to_final(motion, goal, dt)

    def _has_settled(self, motion: Motion) -> bool:
        """Returns True if IMU and odometry show a settled robot. The law looks only at the IMU."""
        rest_began_at = self._settling.rest_began_at
        if rest_began_at is None or not self._settling.has_settled:
            return False
        return self._time - motion.odometry_age >= rest_began_at

    def _finish_state(self, pose: Pose2, goal: Pose2) -> None:
        if self.state is GoalState.ROTATE_TO_GOAL:
            self.state = GoalState.MOVE_FORWARD
        elif self.state is GoalState.MOVE_FORWARD:
            self.state = GoalState.ROTATE_TO_FINAL
        else:
            shortfall = self.law.shortfall_text(pose, goal)
            if not shortfall:
                self.state = GoalState.GOAL_REACHED
            elif self._retries_left:
                self._retries_left -= 1
                self._reset_states()
            else:
                self.failure = shortfall

    def _reset_states(self) -> None:
        self._stalls.clear()
        self._settling = Settling()
        self._law_is_started = False
        self.state = GoalState.ROTATE_TO_GOAL
