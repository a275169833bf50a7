"""Turns that another node commands show how late the samples of a robot are."""
import math
import statistics

import pytest
from spins import miss, reset_in_a_spin
from test_motor_response import response_at

from tb3_labs.control.motor_response import (
    LEAST_SAMPLE_DELAY, LONGEST_AGE, QUIET, HeardTurns, Response)
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.simulation.simulator_config import HOSTS, SimulatorConfig

#: Robots whose samples are as old as those of the firmware on a fast host.
PROMPT = [{}, {'wheel_mismatch': 0.03, 'slip': 0.05}, {'motor_lag': 0.15, 'imu_noise_deg': 0.1}]


def learned(commands, delay=0.1, silent=(), samples=40, age=0.0):
    """Response of a robot that answers a step at 10 s after `delay`; `commands`: (time, linear,
    angular); no samples during `silent`, and these are `age` old."""
    response = Response()
    turns, left = HeardTurns(response), list(commands)
    for tick in range(samples):
        now = 9.9 + 0.03 * tick
        while left and left[0][0] <= now:
            time, linear, angular = left.pop(0)
            turns.on_command(linear, angular, time)
        if not silent or not silent[0] < now < silent[1]:
            travelled, rate = response_at(max(0.0, now - age - 10.0), 1.0, delay, 0.05)
            turns.on_imu(math.remainder(3.0 + travelled, 2.0 * math.pi), rate, age, now)
    return response


@pytest.mark.parametrize('delay, expected', [
    (0.03, LEAST_SAMPLE_DELAY),               # that of the way of a command
    (0.06, LEAST_SAMPLE_DELAY),
    (0.107, 0.107 - 0.5 / 30.0 - 0.008),      # which is 8 ms and half a control period
    (0.3, 0.15)])                             # clipped
def test_what_exceeds_the_way_of_a_command_is_the_age_of_the_samples(delay, expected):
    response = learned([(10.0, 0.0, 1.0), (10.1, 0.0, 1.0)], delay)
    assert response.sample_delay == pytest.approx(expected, abs=0.003)


def test_the_age_that_is_known_is_not_counted_again():
    assert learned([(10.0, 0.0, 1.0)], 0.1, age=0.03).sample_delay == pytest.approx(
        0.1 - 0.074 / 3.0, abs=0.003)


@pytest.mark.parametrize('what', [
    dict(commands=[]),                                                 # a person turns it
    dict(commands=[(10.0, 0.1, 1.0)]),                                 # it drives a curve
    dict(commands=[(10.0 + 0.05 * k, 0.0, 0.3 + 0.1 * k) for k in range(8)]),     # a stick is moved
    dict(commands=[(10.0 - 0.5 * QUIET, 0.0, -1.0), (10.0, 0.0, 1.0)]),      # it was just turning
    dict(commands=[(10.0, 0.0, 1.0)], silent=(10.0, 10.01 + LONGEST_AGE)),      # the network stalls
    dict(commands=[(10.0, 0.0, 1.0)], samples=9)])                              # too short
def test_a_turn_that_does_not_show_the_answer_clearly_teaches_nothing(what):
    response = learned(**what)
    assert (response.sample_delay, response.delay) == (LEAST_SAMPLE_DELAY, Response().delay)


def test_each_turn_counts():
    response = Response()
    for delay in (0.09, 0.13):
        one = learned([(10.0, 0.0, 1.0)], delay)
        for _ in range(20):
            response.measured(one)
    assert response.sample_delay == pytest.approx(0.11 - 0.074 / 3.0, abs=0.012)


def test_a_reset_in_a_spin_behind_a_slow_host():
    off = [reset_in_a_spin(SimulatorConfig(seed=seed, **HOSTS['pi']), (1.0, -1.0)[seed % 2])
           for seed in range(15)]
    assert math.degrees(statistics.median(off)) <= 1.0 and math.degrees(max(off)) <= 2.5
    assert miss(statistics.median(off), Pose2(-0.61, 0.61)) <= 0.020


@pytest.mark.parametrize('robot', PROMPT, ids=str)
def test_a_reset_in_a_spin_of_a_prompt_robot_is_as_exact_as_at_rest(robot):
    robot = SimulatorConfig(**robot)
    assert math.degrees(reset_in_a_spin(robot, spins_before=1)) <= 0.1 + 4.0 * robot.imu_noise_deg
