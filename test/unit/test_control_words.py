"""The words of a pad on ctrl_relinq: in order, none lost, and none too many."""
import pytest

from tb3_labs.nodes.pad import CROSSING, ControlMessages
from tb3_labs.supervision.permission import LONGEST_LAPSE, RENEWAL


def started():
    words = ControlMessages()
    words.take()
    return words


def test_a_pad_that_has_just_started_gives_nothing():
    words = ControlMessages()
    assert words.take() == [False] and not words.gives
    assert words.take() == []


def test_every_press_is_said_in_order():
    words = started()
    words.give(1.0, 0.0)
    words.stop(1.1)
    words.stop(1.2)
    words.give(1.3, 0.0)
    assert words.gives and words.take() == [True, False, False, True]


@pytest.mark.parametrize('renewals', [0, 3])
def test_a_late_press_is_said_with_the_renewals_since(renewals):
    words = started()
    words.give(5.0, (renewals + 0.5) * RENEWAL)
    assert words.take() == (1 + renewals) * [True]


def test_what_others_end_is_said_once_and_only_by_a_pad_that_gives():
    words = started()
    words.end()
    assert words.take() == []
    words.give(1.0, 0.0)
    words.end()
    words.end()
    assert words.take() == [True, False] and not words.gives


def test_what_move_to_goal_said_before_it_heard_of_a_does_not_count():
    words = started()
    assert not words.crossed(5.0)
    words.give(5.0, 0.0)
    assert words.crossed(5.0) and words.crossed(5.0 + 0.9 * CROSSING)
    assert not words.crossed(5.0 + 1.1 * CROSSING)
    words.move_to_goal_has_control()
    assert not words.crossed(5.0)


@pytest.mark.parametrize('stop', ['stop', 'stopped_by_others'])
def test_a_press_from_before_a_stop_is_too_late(stop):
    words = started()
    assert not words.too_late(10.0, LONGEST_LAPSE) and words.too_late(10.0, LONGEST_LAPSE + 0.1)
    getattr(words, stop)(9.5)
    assert words.too_late(10.0, 0.6) and not words.too_late(10.0, 0.4)


def test_a_late_b_does_not_hide_a_later_stop():
    words = started()
    words.stopped_by_others(9.5)
    words.stop(9.0)
    assert words.too_late(10.0, 0.6)
