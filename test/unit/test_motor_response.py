"""Delay, lag and gain must be identified from an exact first-order response with dead time."""
import itertools
import math

import pytest

from tb3_labs.control.commands import CommandHistory
from tb3_labs.control.motor_response import (
    MAX_ONSET_SHARE, MIN_COMMAND_SHARE, MIN_ONSET_SHARE, MIN_SAMPLE_DELAY, Identification, MotorResponse,
    delay_and_lag_at_start)
from tb3_labs.supervision.timeouts import MAX_SAMPLE_AGE

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
    identification.start(begin_speed)
    for tick in range(round(seconds / PERIOD)):
        if tick:
            history.advance(PERIOD)
            travelled, speed = response_at(history.now - age, gain * command, delay, lag)
            identification.update(history, travelled, speed, 1.0, age)
        history.send(command)
    return identification.estimate, learned


@pytest.mark.parametrize('sign', [1.0, -1.0])
@pytest.mark.parametrize('delay, lag', itertools.product([0.0, 0.03, 0.2], [0.01, 0.05, 0.14]))
def test_one_sample_of_a_robot_that_speeds_up_shows_delay_and_lag(delay, lag, sign):
    for later in (0.2 * lag, lag, 2.0 * lag):
        travelled, speed = response_at(delay + later, sign * 1.5, delay, lag)
        assert delay_and_lag_at_start(delay + later, sign * 1.5, travelled, speed) == pytest.approx(
            (delay, lag), abs=1e-9)


@pytest.mark.parametrize('since, first, travelled, speed, told', [
    (0.15, 1.0, 0.05, 1.0, (0.1, 0.0)), (0.15, 1.0, 0.05, 1.2, (0.1, 0.0)),    # at speed at once
    (0.1, 0.1, 0.001, 0.05, None),     # too slow
    (0.1, 1.0, -0.01, -0.5, None),     # the other way
    (0.1, 1.0, 0.2, 0.3, None)])       # a lag beyond all motors
def test_samples_of_prompt_motors_and_samples_that_show_too_little(
        since, first, travelled, speed, told):
    assert delay_and_lag_at_start(since, first, travelled, speed) == (told and pytest.approx(told))


@pytest.mark.parametrize('gain, sign', [(0.97, -1.0), (1.03, 1.0)])
@pytest.mark.parametrize('delay, lag', [(0.02, 0.02), (0.06, 0.05), (0.1, 0.14)])
def test_gain_and_delay_are_identified_separately(
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
    (0.9 * MIN_ONSET_SHARE, False), (1.1 * MIN_ONSET_SHARE, True), (1.1 * MAX_ONSET_SHARE, False),
    (1e307, False)])
def test_only_plausible_speeds_are_used(share, tells):
    history, identification = CommandHistory(PERIOD), Identification(MotorResponse(), True)
    identification.start(0.0)
    history.send(1.0)
    history.advance(0.1)
    identification.update(history, -0.001, share, 1.0)
    assert (identification.estimate.gain != 1.0) is tells


@pytest.mark.parametrize('what', [
    {'begin_speed': 0.2},                      # it moved already: by what command?
    {'command': 0.9 * MIN_COMMAND_SHARE, 'prompt': False},    # too slow
    {'age': 1.1 * MAX_SAMPLE_AGE},                # the network stalls
    {'seconds': 0.1}])                         # over before it was steady
def test_unclear_motions_are_not_learned(what):
    _, learned = identified(0.2, 0.1, **what)
    assert (learned.delay, learned.lag) == (MotorResponse().delay, MotorResponse().lag)


# The node's own turns show how late the samples of a robot are ------------------------------------

@pytest.mark.parametrize('delay, expected', [
    (0.03, MIN_SAMPLE_DELAY),               # the delay of a command's way
    (0.06, MIN_SAMPLE_DELAY),
    (0.107, 0.107 - 0.5 / 30.0 - 0.008),      # which is 8 ms and half a control period
    (0.3, 0.15)])                             # clipped
def test_a_delay_beyond_the_command_time_is_a_sample_delay(delay, expected):
    _, learned = identified(delay, 0.05)
    assert learned.sample_delay == pytest.approx(expected, abs=0.003)


def test_the_age_of_a_sample_is_not_a_delay_of_the_commands():
    estimate, learned = identified(0.1, 0.05, age=0.03)
    assert (estimate.delay, estimate.lag) == pytest.approx((0.1, 0.05), abs=0.001)
    assert learned.sample_delay == pytest.approx(0.1 - 0.074 / 3.0, abs=0.003)
