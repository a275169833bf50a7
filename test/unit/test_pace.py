"""The times of commands, and the length of steps."""
import pytest

from tb3_labs.control.commands import Pace


def test_the_first_step_counts_as_one_period_also_after_a_pause():
    assert all(Pace(2.0).due(now) for now in (0.0, 0.5, 1.5, 100.0))
    pace = Pace(0.02)
    assert not pace.running
    assert pace.step(5.0) == 0.02
    assert pace.running
    assert pace.step(5.03) == pytest.approx(0.03)
    pace.pause()
    assert not pace.running
    assert pace.step(9.0) == 0.02


def test_after_a_late_step_the_next_is_due_half_a_period_later():
    pace = Pace(0.1)
    pace.step(0.0)
    pace.step(0.18)
    assert not pace.due(0.229) and pace.due(0.231)


def test_a_clock_that_goes_back_is_no_step_backwards():
    pace = Pace(0.1)
    pace.step(100.0)
    assert pace.due(3.0)
    assert pace.step(3.0) == 0.0
    assert pace.due(3.11) and not pace.due(3.04)


def test_between_steps_no_sample_needs_a_look():
    pace = Pace(1.0 / 30.0)
    pace.step(5.0)
    woken = 5.0 + pace.idle_for(5.0)
    assert 5.02 < woken < 5.0334
    assert not pace.due(woken - 0.0001)
    assert pace.due(woken + 1e-9)       # the sample that has waited meanwhile takes the step
    assert pace.idle_for(woken) < 1e-9 and pace.idle_for(7.0) == 0.0
    assert pace.idle_for(-100.0) <= 2.0 / 30.0


def test_a_command_that_stays_is_prolonged_by_one_period():
    pace = Pace(0.1)
    pace.step(5.0)
    pace.prolong()
    assert not any(pace.due(5.0 + 0.01 * k) for k in range(19)) and pace.due(5.2)
    assert pace.idle_for(5.0) == pytest.approx(0.2, abs=0.005)
    pace.step(5.2)
    assert not pace.due(5.29) and pace.due(5.31)


def test_steps_after_the_first_are_rather_early_than_late():
    """Looks at 200 Hz, out of step with the steps: never more than 2 ms late."""
    pace, begun, taken = Pace(1.0 / 30.0), None, 0
    for look in range(1000):
        now = 2.0 + 0.005 * look
        if pace.due(now):
            begun = now if begun is None else begun
            pace.step(now)
            assert -0.004 < now - begun - taken / 30.0 < 0.002
            taken += 1
    assert taken == pytest.approx(150, abs=1)
