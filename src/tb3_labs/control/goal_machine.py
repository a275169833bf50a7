"""Driving to a goal in four states, as the Transformation lab lists them.

    ROTATE_TO_GOAL -> MOVE_FORWARD -> ROTATE_TO_FINAL -> GOAL_REACHED

A *law* (:mod:`tb3_labs.control.driving`) says how to move in each of the three driving states and when
the state is finished; this module decides which state it is, watches that the robot gets nearer,
and gives up with a reason where it does not. GOAL_REACHED is said of a robot that rests, as samples
show that were measured while it rested.

A reset or a new goal starts again at ROTATE_TO_GOAL. A goal that was cancelled is over: only
another goal is driven to.

Units: metres, radians, seconds. Poses are in the local frame. Edge case: after GOAL_REACHED or a
failure there is no command at all, not a zero.
Source: the Transformation lab's handout.
"""
from enum import Enum

from tb3_labs.control.settling import REST_ANGULAR, REST_LINEAR, Settling
from tb3_labs.control.speed_laws import Twist2
from tb3_labs.geometry.angles import difference
from tb3_labs.supervision.stall import Progress


class GoalState(Enum):
    """Where a drive stands."""

    ROTATE_TO_GOAL = 'ROTATE_TO_GOAL'
    MOVE_FORWARD = 'MOVE_FORWARD'
    ROTATE_TO_FINAL = 'ROTATE_TO_FINAL'
    GOAL_REACHED = 'GOAL_REACHED'


#: Names of the states in which the robot drives, in order.
DRIVING = tuple(state.name for state in GoalState if state is not GoalState.GOAL_REACHED)
#: `goal_state` is the name of a state, WAITING_FOR_CONTROL, or one of these words and the reason.
WAITING, STOPPED, GAVE_UP = 'waiting', 'stopped', 'gave up'
WAITING_FOR_CONTROL = WAITING + ' for control'


def with_reason(word: str, reason: str) -> str:
    """What `goal_state` says where one of WAITING, STOPPED, GAVE_UP holds for a reason."""
    return '{}: {}'.format(word, reason)


def is_stopped(goal_state: str) -> bool:
    """Does the robot stand for a moment in the midst of a drive?"""
    return goal_state.startswith(STOPPED)


def is_over(goal_state: str) -> bool:
    """Is it the end of a drive?"""
    return goal_state == GoalState.GOAL_REACHED.name or goal_state.startswith(GAVE_UP)


#: A drive that ends outside its tolerance, by a hiccup of the network say, is driven on from there
#: so many times.
MORE_TRIES = 2


class GoalMachine:
    """One robot, one goal at a time.

    `law` has ``start(pose, goal)`` and, for each driving state, a method named like the state in
    lower case: ``(motion, goal, dt) -> motion.LawStep``; besides ``resume(state, pose, goal)``, the
    GoalState in which a drive goes on that was interrupted in `state`, ``shortfall(pose, goal)``,
    '' or what is wrong with the pose in which the last of them ended, and ``distance_tolerance``
    [m].
    """

    def __init__(self, law):
        self.law = law
        self.goal = None
        self.state = GoalState.GOAL_REACHED
        #: Why the drive was given up; '' while it was not.
        self.failure = ''
        #: True where that was by somebody's wish: nothing but another goal is driven to then.
        self.cancelled = False
        #: True once the robot has been told to move for this goal.
        self.begun = False
        #: Counts the drives, a new one with each goal and each restart.
        self.attempt = 0
        self._tries_left = 0
        self._interrupted = False
        self._progress = {}          # of each state since the last restart
        self._settling = Settling()
        self._time = 0.0             # of the steps [s]

    @property
    def active(self):
        """True while there is something left to drive."""
        return self.state is not GoalState.GOAL_REACHED and not self.failure

    def set_goal(self, goal):
        """Take a goal (Pose2 in local), in place of whatever was going on."""
        self.goal = goal
        self.cancelled = False
        self.restart()

    def restart(self):
        """Begin the drive to the goal anew, as after a reset; not to one that was cancelled."""
        if self.goal is not None and not self.cancelled:
            self.failure = ''
            self.begun = self._interrupted = False
            self.attempt += 1
            self._tries_left = MORE_TRIES
            self._begin()

    def interrupt(self):
        """The robot stood for a moment in the midst of a drive, which goes on where it is now."""
        self._interrupted = self.begun

    def give_up(self, reason):
        """End the drive without having reached the goal."""
        self.failure = reason

    def cancel(self):
        """End the drive for good: somebody wishes so."""
        if self.goal is not None:
            self.cancelled = True
            self.give_up('canceled')

    def step(self, motion, dt):
        """The command for now (Twist2), or None where there is nothing (more) to drive.

        `motion` is a localizer.Motion; `dt` is the time since the last step [s].
        """
        if self.active and not self.begun:
            self.begun = True
            self.law.start(motion.pose, self.goal)
        elif self.active and self._interrupted:
            self._resume(motion.pose)
        self._time += dt
        self._settling.look(_is_slow(motion), self._time - motion.imu_age)
        # the place is known by an odometry that was measured while the robot rested
        rests = self._settling.rests and self._time - motion.odometry_age >= self._settling.since
        while self.active:
            move = getattr(self.law, self.state.name.lower())
            command, remaining, finished = move(motion, self.goal, dt)
            if finished and self.state is GoalState.ROTATE_TO_FINAL and not rests:
                return Twist2()
            if not finished:
                progress = self._progress[self.state]
                progress.update(remaining, motion.linear, motion.angular, dt, command != Twist2())
                self.failure = progress.problem()
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
                self.state = GoalState.GOAL_REACHED
            elif self._tries_left:
                self._tries_left -= 1
                self.law.start(pose, self.goal)
                self._begin()
            else:
                self.failure = shortfall

    def _begin(self):
        self._progress = {}
        self._settling = Settling()
        self._enter(GoalState.ROTATE_TO_GOAL)

    def _resume(self, pose):
        self._interrupted = False
        for progress in self._progress.values():
            progress.resume()
        self._enter(self.law.resume(self.state, pose, self.goal))

    def _enter(self, state):
        self.state = state
        self._progress.setdefault(state, Progress())


def _is_slow(motion):
    return abs(motion.linear) <= REST_LINEAR and abs(motion.angular) <= REST_ANGULAR
