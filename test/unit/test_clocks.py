"""Waiting and the steady clock."""
import time

import pytest

pytest.importorskip('rospy')

from tb3_labs.ros.clocks import steady_time, wait_until    # noqa: E402


def test_what_holds_already_is_not_waited_for():
    begun = time.monotonic()
    assert wait_until(lambda: True, 10.0, period=5.0)
    assert time.monotonic() - begun < 5.0


def test_it_waits_until_the_condition_holds():
    answers = iter([False, False, True])
    assert wait_until(lambda: next(answers), 10.0, period=0.001)


def test_it_gives_up_and_says_so():
    begun = time.monotonic()
    assert not wait_until(lambda: False, 0.05, period=0.01)
    assert time.monotonic() - begun >= 0.05


def test_a_condition_is_asked_even_without_time_to_wait():
    assert wait_until(lambda: True, 0.0)


def test_steady_time_goes_on():
    before = steady_time()
    time.sleep(0.02)
    assert 0.02 <= steady_time() - before < 5.0
