"""When commands are due, and how long a step is."""
import pytest

from tb3_labs.pace import Pace


def test_keeps_its_rate_on_average_although_asked_at_other_moments():
    pace, steps = Pace(0.02), 0
    for tick in range(2000):                 # ten seconds at 200 Hz
        if pace.due(tick * 0.005):
            pace.step(tick * 0.005)
            steps += 1
    assert steps == pytest.approx(500, abs=2)


def test_the_first_step_counts_as_one_period_also_after_a_pause():
    pace = Pace(0.02)
    assert not pace.running
    assert pace.step(5.0) == 0.02
    assert pace.running
    assert pace.step(5.03) == pytest.approx(0.03)
    pace.pause()
    assert not pace.running
    assert pace.step(9.0) == 0.02


def test_a_long_hiccup_is_not_made_up_for():
    pace = Pace(0.1)
    pace.step(0.0)
    pace.step(1.0)
    assert not pace.due(1.04)
    assert pace.due(1.1)


def test_a_clock_that_goes_back_is_no_step_backwards():
    pace = Pace(0.1)
    pace.step(100.0)
    assert pace.due(3.0)
    assert pace.step(3.0) == 0.0
    assert pace.due(3.11) and not pace.due(3.04)
