"""Driving to a goal in four states, as the Transformation lab lists them.

    ROTATE_TO_GOAL -> MOVE_FORWARD -> ROTATE_TO_FINAL -> GOAL_REACHED

A *law* (:mod:`tb3_labs.drive_laws`) says how to move in each of the three driving states and when
the state is finished; this module decides which state it is, watches that the robot gets on, and
gives up with a reason where it does not. A reset or a new goal starts again at ROTATE_TO_GOAL.

Units: metres, radians, seconds. Poses are in the local frame. Edge case: after GOAL_REACHED or a
failure there is no command at all, not a zero.
Source: the Transformation lab's handout.
"""
from enum import Enum

from tb3_labs.angles import difference
from tb3_labs.progress import Progress


class GoalState(Enum):
    """Where a drive stands."""

    ROTATE_TO_GOAL = 'ROTATE_TO_GOAL'
    MOVE_FORWARD = 'MOVE_FORWARD'
    ROTATE_TO_FINAL = 'ROTATE_TO_FINAL'
    GOAL_REACHED = 'GOAL_REACHED'


#: Names of the states in which the robot drives, in order.
DRIVING = tuple(state.name for state in GoalState if state is not GoalState.GOAL_REACHED)


#: A drive that ends outside its tolerance, by a hiccup of the network say, is driven on from there
#: so many times.
MORE_TRIES = 2


class GoalMachine:
    """One robot, one goal at a time.

    `law` has ``start(pose, goal)`` and, for each driving state, a method named like the state in
    lower case: ``(motion, goal, dt) -> motion.LawStep``; besides ``shortfall(pose, goal)``, '' or
    what is wrong with the pose in which the last of them ended, and ``distance_tolerance`` [m].
    """

    def __init__(self, law):
        self.law = law
        self.goal = None
        self.state = GoalState.GOAL_REACHED
        #: Why the drive was given up; '' while it was not.
        self.failure = ''
        #: True once the robot has been told to move for this goal.
        self.begun = False
        #: Counts the drives, a new one with each goal and each restart.
        self.attempt = 0
        self._tries_left = 0
        self._progress = Progress()

    @property
    def active(self):
        """True while there is something left to drive."""
        return self.state is not GoalState.GOAL_REACHED and not self.failure

    def set_goal(self, goal):
        """Take a goal (Pose2 in local), in place of whatever was going on."""
        self.goal = goal
        self.restart()

    def restart(self):
        """Begin the drive to the goal anew: after a reset, or when control comes back."""
        if self.goal is not None:
            self.failure = ''
            self.begun = False
            self.attempt += 1
            self._tries_left = MORE_TRIES
            self._enter(GoalState.ROTATE_TO_GOAL)

    def give_up(self, reason):
        """End the drive without having reached the goal."""
        self.failure = reason

    def step(self, motion, dt):
        """The command for now (Twist2), or None where there is nothing (more) to drive.

        `motion` is a localizer.Motion; `dt` is the time since the last step [s].
        """
        if self.active and not self.begun:
            self.begun = True
            self.law.start(motion.pose, self.goal)
        while self.active:
            move = getattr(self.law, self.state.name.lower())
            command, remaining, finished = move(motion, self.goal, dt)
            if not finished:
                self.failure = self._progress.complaint(remaining, motion, dt)
                return None if self.failure else command
            self._finish_state(motion.pose)
            dt = 0.0
        return None

    def errors(self, pose):
        """(distance [m], angle [rad]) by which `pose` misses the goal."""
        return pose.distance_to(self.goal), difference(self.goal.yaw, pose.yaw)

    def _finish_state(self, pose):
        if self.state is GoalState.ROTATE_TO_GOAL:
            self._enter(GoalState.MOVE_FORWARD)
        elif self.state is GoalState.MOVE_FORWARD:
            self._enter(GoalState.ROTATE_TO_FINAL)
        else:
            shortfall = self.law.shortfall(pose, self.goal)
            if not shortfall:
                self._enter(GoalState.GOAL_REACHED)
            elif self._tries_left:
                self._tries_left -= 1
                self.law.start(pose, self.goal)
                self._enter(GoalState.ROTATE_TO_GOAL)
            else:
                self.failure = shortfall

    def _enter(self, state):
        self.state = state
        self._progress = Progress()
