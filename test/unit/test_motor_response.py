"""Delay and lag must be identified from an exact first-order response with dead time."""
import itertools
import math

import pytest

from tb3_labs.control.dead_time import CommandHistory
from tb3_labs.control.motor_response import (
    CRUISING, LEARNING, LEARNING_TIME, MAX_DELAY, Identification, Response, look_at_cruise,
    look_at_start)

PERIOD = 0.02


def response_at(time, command, delay, lag):
    """(travel, speed) of a motor that gets `command` at time 0, at rest."""
    since = max(0.0, time - delay)
    speed = command * -math.expm1(-since / lag) if lag else (command if since else 0.0)
    return command * since - lag * speed, speed


def identified(delay, lag, command=1.0, begin_speed=0.0, prompt=True, seconds=1.0,
               learned=None):
    """The Response after an approach that commands one speed from the start."""
    learned = learned or Response()
    identification, history = Identification(learned, prompt), CommandHistory(PERIOD)
    identification.begin(begin_speed)
    for tick in range(round(seconds / PERIOD)):
        if tick:
            history.advance(PERIOD)
            identification.look(history, *response_at(history.now, command, delay, lag), 1.0)
        history.send(command)
    return identification.estimate, learned


@pytest.mark.parametrize('sign', [1.0, -1.0])
@pytest.mark.parametrize('delay, lag', itertools.product([0.0, 0.03, 0.2], [0.01, 0.05, 0.14]))
def test_one_sample_of_a_robot_that_speeds_up_tells_delay_and_lag(delay, lag, sign):
    for later in (0.2 * lag, lag, 2.0 * lag):
        travelled, speed = response_at(delay + later, sign * 1.5, delay, lag)
        assert look_at_start(delay + later, sign * 1.5, travelled, speed) == pytest.approx(
            (delay, lag), abs=1e-9)


def test_motors_that_are_at_speed_at_once_have_no_lag():
    assert look_at_start(0.15, 1.0, 0.05, 1.0) == pytest.approx((0.1, 0.0))
    assert look_at_start(0.15, 1.0, 0.05, 1.2) == pytest.approx((0.1, 0.0))


@pytest.mark.parametrize('first, travelled, speed', [
    (0.1, 0.001, 0.05),       # too slow to tell
    (1.0, -0.01, -0.5),       # the other way
    (1.0, 0.2, 0.3)])         # a lag beyond all motors
def test_a_sample_that_says_too_little_is_not_used(first, travelled, speed):
    assert look_at_start(0.1, first, travelled, speed) is None


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_at_cruise_the_travel_that_is_missing_tells_delay_and_lag_together(sign):
    travelled, speed = response_at(2.0, sign * 1.5, 0.07, 0.04)
    assert look_at_cruise(sign * 1.5 * 2.0, travelled, speed) == pytest.approx(0.11)


def test_a_total_beyond_all_delays_is_cut():
    assert look_at_cruise(2.0, 0.0, 1.0) == MAX_DELAY
    assert look_at_cruise(0.0, 2.0, 1.0) == 0.0


@pytest.mark.parametrize('sign', [1.0, -1.0])
@pytest.mark.parametrize('delay, lag', [(0.0, 0.05), (0.1, 0.02), (0.2, 0.1)])
def test_an_approach_by_a_gyro_identifies_both(delay, lag, sign):
    estimate, learned = identified(delay, lag, command=sign)
    assert estimate.delay == pytest.approx(delay, abs=0.001)
    assert estimate.delay + estimate.lag == pytest.approx(delay + lag, abs=0.004)
    assert learned.delay == pytest.approx(delay, abs=0.02)


def test_without_a_gyro_the_lag_is_believed_and_the_delay_identified():
    estimate, _ = identified(0.12, 0.05, prompt=False, learned=Response(0.0, 0.05))
    assert estimate.lag == 0.05
    assert estimate.delay == pytest.approx(0.12, abs=0.004)


@pytest.mark.parametrize('what', [
    {'begin_speed': 0.2},                      # it moved already: by what command?
    {'command': 0.9 * CRUISING, 'prompt': False},    # too slow
    {'seconds': 0.1}])                         # over before it was steady
def test_what_tells_nothing_teaches_nothing(what):
    _, learned = identified(0.2, 0.1, **what)
    assert (learned.delay, learned.lag) == (Response().delay, Response().lag)


@pytest.mark.parametrize('command', [0.5, -2.0])
@pytest.mark.parametrize('share, is_steady', [(0.91, False), (0.93, True), (1.07, True)])
def test_steady_is_within_8_percent_of_the_command(command, share, is_steady):
    learned, history = Response(), CommandHistory(PERIOD)
    identification = Identification(learned, speed_is_prompt=False)
    identification.begin(0.0)
    for _ in range(10):
        history.send(command)
        history.advance(PERIOD)
    identification.look(history, 0.0, share * command, 2.0 * abs(command))
    assert (learned.delay != Response().delay) is is_steady


def test_learning_ends_before_errors_of_the_gain_add_up():
    _, long = identified(0.1, 0.05, seconds=LEARNING_TIME + 3.0)
    _, short = identified(0.1, 0.05, seconds=LEARNING_TIME + 2.0 * PERIOD)
    assert (long.delay, long.lag) == (short.delay, short.lag)


def test_each_measurement_moves_what_is_known_by_a_share():
    response = Response(0.1, 0.05)
    response.measured(0.2, 0.15)
    assert response.delay == pytest.approx(0.1 + 0.1 * LEARNING)
    assert response.lag == pytest.approx(0.05 + 0.1 * LEARNING)
