"""Delay, lag and gain must be identified from an exact first-order response with dead time."""
import itertools
import math
import random
import statistics

import pytest

from rollout import navigation, run
from tb3_labs.control.commands import CommandHistory
from tb3_labs.control.drive_law import DriveLaw
from tb3_labs.control.goal_state import DriveConfig
from tb3_labs.control.motor_response import (
    MIN_CRUISE_SHARE, MIN_SAMPLE_DELAY, SPEEDING_UP_SHARES, Identification, MotorResponse, identify_at_start)
from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.localization.localizer import Reset
from tb3_labs.nodes.move_to_goal.core import MoveToGoalCore
from tb3_labs.robot.turtlebot3 import Twist2, robot_model
from tb3_labs.simulation.simulator import Simulator
from tb3_labs.simulation.simulator_config import HOSTS, SimulatorConfig
from tb3_labs.supervision.events import Event, Output
from tb3_labs.supervision.goal_requests import RequestedPose
from tb3_labs.supervision.timeouts import MAX_AGE

PERIOD = 0.02


def response_at(time, command, delay, lag):
    """(travel, speed) of a motor that gets `command` at time 0, at rest."""
    since = max(0.0, time - delay)
    speed = command * -math.expm1(-since / lag) if lag else (command if since else 0.0)
    return command * since - lag * speed, speed


def identified(delay, lag, command=1.0, begin_speed=0.0, prompt=True, seconds=1.0,
               learned=None, gain=1.0, age=0.0):
    """The MotorResponse after an approach that commands one speed from the start, by samples of this age.
    """
    learned = learned or MotorResponse()
    identification, history = Identification(learned, prompt), CommandHistory(PERIOD)
    identification.begin(begin_speed)
    for tick in range(round(seconds / PERIOD)):
        if tick:
            history.advance(PERIOD)
            travelled, speed = response_at(history.now - age, gain * command, delay, lag)
            identification.update(history, travelled, speed, 1.0, age)
        history.send(command)
    return identification.estimate, learned


@pytest.mark.parametrize('sign', [1.0, -1.0])
@pytest.mark.parametrize('delay, lag', itertools.product([0.0, 0.03, 0.2], [0.01, 0.05, 0.14]))
def test_one_sample_of_a_robot_that_speeds_up_tells_delay_and_lag(delay, lag, sign):
    for later in (0.2 * lag, lag, 2.0 * lag):
        travelled, speed = response_at(delay + later, sign * 1.5, delay, lag)
        assert identify_at_start(delay + later, sign * 1.5, travelled, speed) == pytest.approx(
            (delay, lag), abs=1e-9)


@pytest.mark.parametrize('since, first, travelled, speed, told', [
    (0.15, 1.0, 0.05, 1.0, (0.1, 0.0)), (0.15, 1.0, 0.05, 1.2, (0.1, 0.0)),    # at speed at once
    (0.1, 0.1, 0.001, 0.05, None),     # too slow to tell
    (0.1, 1.0, -0.01, -0.5, None),     # the other way
    (0.1, 1.0, 0.2, 0.3, None)])       # a lag beyond all motors
def test_a_sample_of_motors_without_lag_and_one_that_says_too_little(
        since, first, travelled, speed, told):
    assert identify_at_start(since, first, travelled, speed) == (told and pytest.approx(told))


@pytest.mark.parametrize('gain, sign', [(0.97, -1.0), (1.03, 1.0)])
@pytest.mark.parametrize('delay, lag', [(0.02, 0.02), (0.06, 0.05), (0.1, 0.14)])
def test_a_robot_that_is_faster_than_commanded_is_not_taken_for_a_prompt_one(
        delay, lag, gain, sign):
    """In 1 s it travels 30 mm or mrad too far, as one would that is prompter by 30 ms."""
    estimate, learned = identified(delay, lag, sign, gain=gain)
    assert estimate.gain == pytest.approx(gain, abs=0.001)
    assert estimate.delay == pytest.approx(delay, abs=0.002)
    assert estimate.lag == pytest.approx(lag, abs=0.002)
    assert abs(learned.gain - gain) < abs(1.0 - gain)
    at_start, _ = identified(delay, lag, sign, gain=gain, learned=MotorResponse(gain=gain),
                             seconds=delay + 3.0 * PERIOD)
    assert (at_start.delay, at_start.lag) == pytest.approx((delay, lag), abs=1e-6)
    assert identified(delay, lag, sign, gain=gain, prompt=False, learned=MotorResponse(0.0, lag))[
        0].delay == pytest.approx(delay, abs=0.004)


@pytest.mark.parametrize('share, tells', [
    (0.9 * SPEEDING_UP_SHARES[0], False), (1.1 * SPEEDING_UP_SHARES[0], True), (1.1 * SPEEDING_UP_SHARES[1], False),
    (1e307, False)])
def test_a_robot_that_has_hardly_begun_to_move_or_moves_otherwise_tells_nothing(share, tells):
    history, identification = CommandHistory(PERIOD), Identification(MotorResponse(), True)
    identification.begin(0.0)
    history.send(1.0)
    history.advance(0.1)
    identification.update(history, -0.001, share, 1.0)
    assert (identification.estimate.gain != 1.0) is tells


@pytest.mark.parametrize('what', [
    {'begin_speed': 0.2},                      # it moved already: by what command?
    {'command': 0.9 * MIN_CRUISE_SHARE, 'prompt': False},    # too slow
    {'age': 1.1 * MAX_AGE},                # the network stalls
    {'seconds': 0.1}])                         # over before it was steady
def test_what_tells_nothing_teaches_nothing(what):
    _, learned = identified(0.2, 0.1, **what)
    assert (learned.delay, learned.lag) == (MotorResponse().delay, MotorResponse().lag)


# The node's own turns show how late the samples of a robot are ------------------------------------

@pytest.mark.parametrize('delay, expected', [
    (0.03, MIN_SAMPLE_DELAY),               # the delay of a command's way
    (0.06, MIN_SAMPLE_DELAY),
    (0.107, 0.107 - 0.5 / 30.0 - 0.008),      # which is 8 ms and half a control period
    (0.3, 0.15)])                             # clipped
def test_what_exceeds_the_way_of_a_command_is_the_age_of_the_samples(delay, expected):
    _, learned = identified(delay, 0.05)
    assert learned.sample_delay == pytest.approx(expected, abs=0.003)


def test_the_age_of_a_sample_is_no_delay_of_the_commands_nor_is_it_counted_again():
    estimate, learned = identified(0.1, 0.05, age=0.03)
    assert (estimate.delay, estimate.lag) == pytest.approx((0.1, 0.05), abs=0.001)
    assert learned.sample_delay == pytest.approx(0.1 - 0.074 / 3.0, abs=0.003)


class OtherNode:
    """Commands one rate of turn repeatedly; the navigator gets the samples."""

    rate, fix, _next = 0.0, None, 0.0

    def __init__(self, navigator):
        self._navigator = navigator

    def tick(self, now, steady_now):
        self.fix = self._navigator.tick(now, steady_now).fix or self.fix    # the latest
        if now < self._next:
            return Output()
        self._next = now + 0.1
        self._navigator.on_command('', 0.0, self.rate, now)
        return Output(Twist2(0.0, self.rate))


def reset_in_a_spin(robot_config, rate=1.0, after=None):
    """Angle by which the pose is off after a reset while another node spins the robot at `rate`.
    The navigator has driven to the goal `after` before this test."""
    rng = random.Random(robot_config.seed)
    robot, model, response = Simulator(robot_config), robot_model(robot_config.model), MotorResponse()
    navigator = MoveToGoalCore(DriveLaw(DriveConfig(), model, response), response=response)
    node, hear = OtherNode(navigator), navigation(robot, navigator)

    def spin(at, seconds):
        node.rate = at
        run(robot, node, hear, seconds)

    spin(0.0, 1.0)
    if after is not None:
        navigator.on_ctrl_relinq(Event(True, robot.now))
        navigator.set_goal(after)
        while navigator.status(robot.now).active:
            run(robot, navigator, hear, 0.1)
        navigator.on_ctrl_relinq(Event(False, robot.now))
    spin(0.0, 1.0 + rng.random())
    spin(rate, 1.0 + rng.random())
    there, reset = robot.truth, Reset(RequestedPose(Pose2()))
    navigator.on_reset(reset, robot.now, robot.now)
    while not reset.done:
        spin(rate, PERIOD)
    spin(0.0, 1.5)
    return abs(difference(node.fix.local_T_base.yaw, (there.inverse() @ robot.truth).yaw))


def test_a_reset_in_a_spin_behind_a_slow_host():
    """Before its first turn the node does not know how late the samples are."""
    unknown = [reset_in_a_spin(SimulatorConfig(seed=seed, **HOSTS['pi'])) for seed in range(3)]
    assert math.degrees(max(unknown)) <= 5.0
    off = [reset_in_a_spin(SimulatorConfig(seed=seed, **HOSTS['pi']), (1.0, -1.0)[seed % 2],
                           after=Pose2(0.0, 0.0, 2.0)) for seed in range(5)]
    assert math.degrees(statistics.median(off)) <= 1.0 and math.degrees(max(off)) <= 2.5
