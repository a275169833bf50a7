"""A process that did not run: noticed at the next look at the clock, and once."""
import pytest

from tb3_labs.supervision.permission import SleepWatch


def test_the_first_look_sees_no_sleep():
    watch = SleepWatch()
    assert watch.slept_for == 0.0
    watch.update(1e9)
    assert watch.slept_for == 0.0 and watch.in_words() == ''


def test_a_simulated_clock_that_begins_is_no_sleep():
    watch = SleepWatch()
    for now in (0.0, 0.0, 1.79e9):
        watch.update(now)
        assert watch.slept_for == 0.0


@pytest.mark.parametrize('gap, slept', [(0.0, 0.0), (1.0, 0.0), (1.25, 1.25), (3600.0, 3600.0),
                                        (-50.0, 0.0)])
def test_a_gap_beyond_the_limit_is_a_sleep(gap, slept):
    watch = SleepWatch()
    watch.update(100.0)
    watch.update(100.0 + gap)
    assert watch.slept_for == slept
    watch.update(100.0 + gap)
    assert watch.slept_for == 0.0


@pytest.mark.parametrize('later, waking', [(0.0, True), (0.25, True), (0.375, False)])
def test_messages_may_be_as_old_as_the_sleep_for_a_moment(later, waking):
    watch = SleepWatch()
    watch.update(100.0)
    assert not watch.is_waking
    watch.update(102.0)
    watch.update(102.0 + later)
    assert watch.is_waking is waking


def test_it_is_said_how_long():
    watch = SleepWatch()
    watch.update(10.0)
    watch.update(13.25)
    assert watch.in_words() == 'this node did not run for 3.2 s'


def test_nobody_needed_to_look_before_the_start():
    watch = SleepWatch()
    watch.update(10.0)
    watch.start(100.0)
    assert watch.slept_for == 0.0
    watch.update(103.0)
    assert watch.slept_for == 3.0
