"""The four states, and the ends of a drive; with a law that only repeats given answers."""
from functools import partialmethod

import pytest

from tb3_labs.control.commands import LawStep
from tb3_labs.control.goal_machine import GoalMachine, GoalState
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.samples import Motion
from tb3_labs.robot.turtlebot3 import Twist2
from tb3_labs.supervision.timeouts import STALL_TIME

GOAL = Pose2(1.0, 0.0, 0.5)
STANDING = Motion(Pose2(), 0.0, 0.0)
MOVING = Motion(Pose2(), 0.1, 0.0)
STATES = 'rotate_to_goal', 'move_forward', 'rotate_to_final'


class GivenDriveLaw:
    """A law that returns a given remaining way in each state; a state is finished at 0."""

    def __init__(self, shortfall='', left=1.0):
        self.left = dict.fromkeys(STATES, left)
        self.starts = 0
        self.times = []          # dt of each look
        self._shortfall = shortfall

    def start(self, pose, goal):
        self.starts += 1

    def shortfall_text(self, pose, goal):
        return self._shortfall

    def _answer(self, state, _motion, _goal, dt):
        self.times.append(dt)
        return LawStep(Twist2(0.1, 0.2), self.left[state], self.left[state] == 0.0)

    rotate_to_goal = partialmethod(_answer, 'rotate_to_goal')
    move_forward = partialmethod(_answer, 'move_forward')
    rotate_to_final = partialmethod(_answer, 'rotate_to_final')


def machine_with(law):
    """A machine that drives to GOAL by this law."""
    machine = GoalMachine(law)
    machine.set_goal(GOAL)
    return machine


def test_finished_states_are_passed_through_within_one_step():
    law = GivenDriveLaw()
    law.left.update(rotate_to_goal=0.0, move_forward=0.0)
    machine = machine_with(law)
    assert machine.step(STANDING, 0.1) == Twist2(0.1, 0.2)
    assert machine.state is GoalState.ROTATE_TO_FINAL
    assert law.times == [0.1, 0.0, 0.0]      # the time passed once


def test_a_canceled_drive_does_not_begin_again():
    machine = GoalMachine(GivenDriveLaw())
    machine.cancel()
    machine.begin_drive()       # without a goal
    assert (machine.failure, machine.has_begun, machine.step(STANDING, 0.1)) == ('', False, None)
    for reason, after in (('it slipped', ''), ('canceled', 'canceled')):
        machine.set_goal(GOAL)
        machine.cancel() if after else machine.give_up(reason)
        assert machine.failure == reason
        machine.begin_drive()
        assert machine.failure == after
        machine.set_goal(GOAL)
        assert machine.failure == ''


@pytest.mark.parametrize('misses, starts, reached', [
    (0, 1, True), (1, 2, True), (2, 3, True), (3, 3, False)])
def test_a_drive_that_ends_outside_the_tolerance_has_two_more_tries(misses, starts, reached):
    law = GivenDriveLaw(left=0.0)
    ends = iter(misses * ['stopped 30 mm from the goal'] + [''])
    law.shortfall_text = lambda pose, goal: next(ends)
    machine = machine_with(law)
    assert [machine.step(STANDING, 0.033) for _ in range(30)][-1] is None
    assert law.starts == starts
    assert (machine.state is GoalState.GOAL_REACHED) is reached
    assert machine.failure == ('' if reached else 'stopped 30 mm from the goal')


def test_each_try_waits_until_the_robot_settled():
    law = GivenDriveLaw('stopped 30 mm from the goal', left=0.0)
    machine = machine_with(law)
    answers = [machine.step(STANDING, 0.02) for _ in range(9)]
    # at rest for 0.03 s: after three looks, three times
    assert law.starts == 3 and answers == 8 * [Twist2()] + [None]


@pytest.mark.parametrize('ages', [('imu_age',), ('odometry_age',), ('imu_age', 'odometry_age')])
def test_one_sample_at_rest_does_not_end_a_drive(ages):
    machine, age = machine_with(GivenDriveLaw(left=0.0)), 0.0    # its law has finished
    machine.step(MOVING, 0.033)
    for _ in range(30):
        age += 0.033      # no sample has come since
        motion = Motion(Pose2(), 0.0, 0.0, **dict.fromkeys(ages, age))
        assert machine.step(motion, 0.033) == Twist2()
    assert machine.state is GoalState.ROTATE_TO_FINAL


def test_an_interrupted_drive_begins_at_its_present_pose():
    law = GivenDriveLaw()
    machine = machine_with(law)
    law.left.update(rotate_to_goal=0.0, move_forward=0.0)
    machine.step(STANDING, 0.1)
    assert machine.state is GoalState.ROTATE_TO_FINAL
    machine.restart_law()
    law.left['rotate_to_goal'] = 1.0
    for _ in range(2):      # once for each interruption
        assert machine.step(STANDING, 0.1) is not None
        assert machine.state is GoalState.ROTATE_TO_GOAL
        assert (law.starts, machine.attempt) == (2, 1)
    machine.restart_law()
    machine.begin_drive()       # a new drive
    machine.step(STANDING, 0.1)
    assert (law.starts, machine.attempt) == (3, 2)


@pytest.mark.parametrize('motion, reason', [(STANDING, 'does not move'), (MOVING, 'missed it')])
def test_a_stalled_drive_is_given_up_in_spite_of_interruptions(motion, reason):
    machine = machine_with(GivenDriveLaw())
    driven = 0.0
    while machine.step(motion, 0.033) is not None and driven < 10.0:
        driven += 0.033
        if round(driven / 0.033) % 10 == 0:    # every third of a second
            machine.restart_law()
    assert reason in machine.failure
    assert STALL_TIME <= driven <= STALL_TIME + 0.1
