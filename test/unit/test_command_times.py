"""Commands: their times, the travel that is under way, and a number by noisy samples."""
import math

import pytest

from tb3_labs.control.braking import CONTRADICTING_DEVIATIONS, FilteredNumber
from tb3_labs.control.commands import CommandHistory, Pace

PERIOD = 0.02


def test_the_first_step_counts_as_one_period_also_after_a_pause():
    assert all(Pace(2.0).is_due(now) for now in (0.0, 0.5, 1.5, 100.0))
    pace = Pace(0.02)
    for begin in 5.0, 9.0:
        assert not pace.is_running
        assert pace.step(begin) == 0.02 and pace.is_running
        assert pace.step(begin + 0.03) == pytest.approx(0.03)
        pace.restart()


def test_after_a_late_step_the_next_is_due_half_a_period_later():
    pace = Pace(0.1)
    pace.step(0.0)
    pace.step(0.18)
    assert not pace.is_due(0.229) and pace.is_due(0.231)


def test_a_clock_that_goes_back_gives_a_step_of_zero():
    pace = Pace(0.1)
    pace.step(100.0)
    assert pace.is_due(3.0)
    assert pace.step(3.0) == 0.0
    assert pace.is_due(3.11) and not pace.is_due(3.04)


def test_a_pace_is_idle_until_the_next_step():
    pace = Pace(1.0 / 30.0)
    pace.step(5.0)
    woken = 5.0 + pace.idle_time(5.0)
    assert 5.02 < woken < 5.0334
    assert not pace.is_due(woken - 0.0001)
    assert pace.is_due(woken + 1e-9)       # the sample that has waited meanwhile takes the step
    assert pace.idle_time(woken) < 1e-9 and pace.idle_time(7.0) == 0.0
    assert pace.idle_time(-100.0) <= 2.0 / 30.0


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
    # at 0.06 s the two latest commands, and the last 10 ms of the first, are under way
    assert history.travel_under_way(0.05) == pytest.approx(0.02 * 0.3 + 0.02 * 0.2 + 0.01 * 0.1)
    assert history.travel_under_way(0.0) == 0.0
    assert history.travel_under_way(10.0) == pytest.approx(0.012)
    assert history.first_command == 0.1


def test_nothing_is_under_way_before_the_first_command():
    history = CommandHistory(PERIOD)
    assert history.travel_under_way(0.3) == 0.0
    assert history.command_at_motors(0.0) == 0.0
    assert history.sent_only_stops_since(-math.inf)
    history.advance(PERIOD)
    assert history.unchanged_for == PERIOD


@pytest.mark.parametrize('delay, command', [(0.0, 0.3), (0.015, 0.3), (0.03, 0.2), (0.05, 0.1),
                                            (0.07, 0.0)])
def test_the_arrived_command_was_sent_one_delay_ago(delay, command):
    assert history_of([0.1, 0.2, 0.3], extra=PERIOD).command_at_motors(delay) == command


def test_commands_are_forgotten_but_not_their_travel():
    """In the last 5 s all commands were 0.2, and the commands before are forgotten."""
    history = history_of([0.1] * 250 + [0.2] * 250, extra=PERIOD)
    assert history.commanded_travel(history.now) == pytest.approx(1.5)
    assert history.travel_under_way(10.0) == pytest.approx(10.0 * 0.2)


def estimate_of(*samples, noise=0.1):
    estimate = FilteredNumber()
    for sample in samples:
        estimate.add(sample, noise)
    return estimate


def test_the_estimate_of_a_constant_is_the_mean():
    estimate = estimate_of(0.1, 0.2, 0.3, 0.4)
    assert estimate.value == pytest.approx(0.25)
    assert estimate.uncertainty == pytest.approx(0.1)       # 2 x 0.1 / sqrt(4)


def test_a_change_shifts_the_estimate_and_adds_its_variance():
    estimate = estimate_of(1.0)
    estimate.shift(0.5, 0.1)
    assert estimate.value == 1.5
    assert estimate.uncertainty == pytest.approx(2.0 * math.hypot(0.1, 0.1))
    estimate.add(1.8, 0.1)      # now it has twice the weight of the estimate before
    assert estimate.value == pytest.approx(1.7)


@pytest.mark.parametrize('sign', [1.0, -1.0])
@pytest.mark.parametrize('share, value', [(0.99, 0.5), (1.01, 1.0)])
def test_a_sample_that_contradicts_the_estimate_takes_its_place(share, value, sign):
    far = sign * share * CONTRADICTING_DEVIATIONS * math.hypot(0.1, 0.1)
    assert estimate_of(0.0, far).value == pytest.approx(value * far)
