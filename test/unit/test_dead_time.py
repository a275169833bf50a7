"""The travel that is commanded and not yet driven, against closed forms."""
import math

import pytest

from tb3_labs.control.commands import CommandHistory, followed

PERIOD = 0.02


def history_of(commands, extra=0.0):
    """A history of one command in each period, `extra` seconds after the last period's begin."""
    history = CommandHistory(PERIOD)
    for index, command in enumerate(commands):
        if index:
            history.advance(PERIOD)
        history.send(command)
    history.advance(extra)
    return history


def test_travel_under_way_is_the_sum_of_the_commands_within_the_delay():
    history = history_of([0.1, 0.2, 0.3], extra=PERIOD)
    # at 0.06 s: the two latest are under way as a whole, and the last 10 ms of the first
    assert history.travel_under_way(0.05) == pytest.approx(0.02 * 0.3 + 0.02 * 0.2 + 0.01 * 0.1)
    assert history.travel_under_way(0.0) == 0.0
    assert history.travel_under_way(10.0) == pytest.approx(0.012)
    assert history.first == 0.1


def test_nothing_is_under_way_before_the_first_command():
    history = CommandHistory(PERIOD)
    assert history.travel_under_way(0.3) == 0.0
    assert history.arrived(0.0) == 0.0
    assert history.only_stops_since(-math.inf)
    history.advance(PERIOD)
    assert history.unchanged_for == PERIOD


@pytest.mark.parametrize('delay, command', [(0.0, 0.3), (0.015, 0.3), (0.03, 0.2), (0.05, 0.1),
                                            (0.07, 0.0)])
def test_the_command_that_arrives_is_the_one_of_a_delay_ago(delay, command):
    assert history_of([0.1, 0.2, 0.3], extra=PERIOD).arrived(delay) == command


def test_all_that_was_commanded_is_counted():
    history = history_of([0.5] * 10, extra=0.9 * PERIOD)
    assert history.commanded(history.now) == pytest.approx(0.5 * 9.9 * PERIOD)
    assert history.commanded(history.begin) == pytest.approx(0.5 * 10.0 * PERIOD)
    assert history.unchanged_for == pytest.approx(9.9 * PERIOD)
    assert CommandHistory(PERIOD).commanded(PERIOD) == 0.0


def test_commands_are_forgotten_but_not_their_travel():
    history = history_of([0.1] * 500, extra=PERIOD)
    assert history.commanded(history.now) == pytest.approx(0.1 * 500 * PERIOD)
    assert history.travel_under_way(10.0) < 0.1 * 1.5


@pytest.mark.parametrize('lag', [0.0, 0.02, 0.1])
@pytest.mark.parametrize('steps', [1, 7])
def test_a_motor_follows_exponentially_in_however_many_steps(lag, steps):
    speed = 0.2
    for _ in range(steps):
        speed = followed(speed, -1.0, lag, 0.05 / steps)
    assert speed == pytest.approx(-1.0 + 1.2 * (math.exp(-0.05 / lag) if lag else 0.0))
    assert followed(0.2, 1.0, 0.05, 0.0) == 0.2
