"""One turn: the angle asked for, the remaining angle, and the text of its result."""
import math

import pytest

from tb3_labs.nodes.controller import Turn


def test_a_turn_makes_up_for_what_the_one_before_left():
    turn = Turn(asked=math.pi / 2.0, yaw=1.0, carried=0.01, now=5.0)
    assert turn.goal == pytest.approx(1.0 + math.pi / 2.0 + 0.01)
    assert turn.left(1.0) == pytest.approx(math.pi / 2.0 + 0.01)


@pytest.mark.parametrize('degrees, more', [(90.0, 90.0), (90.0, -180.0), (-90.0, -0.5)])
def test_more_is_added_to_the_goal(degrees, more):
    turn = Turn(math.radians(degrees), 0.3, 0.0, 5.0)
    turn.extend(math.radians(more))
    assert math.degrees(turn.asked) == pytest.approx(degrees + more)
    assert math.degrees(turn.left(0.3)) == pytest.approx(degrees + more)


@pytest.mark.parametrize('asked, turned, words', [
    (90.0, 89.0, 'Turned 89.00 degrees in 2.5 s: 1.00 degrees short of 90.00'),
    (90.0, 91.0, 'Turned 91.00 degrees in 2.5 s: 1.00 degrees beyond 90.00'),
    (-90.0, -89.0, 'Turned -89.00 degrees in 2.5 s: 1.00 degrees short of -90.00'),
    (-90.0, -91.0, 'Turned -91.00 degrees in 2.5 s: 1.00 degrees beyond -90.00')])
def test_the_result_is_told_by_the_sign_of_what_was_asked(asked, turned, words):
    turn = Turn(math.radians(asked), 0.2, 0.0, 5.0)
    assert turn.result(0.2 + math.radians(turned), 7.5) == words


def test_a_result_tells_what_the_turn_before_left():
    turn = Turn(math.radians(90.0), 0.0, math.radians(0.21), 5.0)
    assert turn.result(math.radians(90.0), 7.0) == (
        'Turned 90.00 degrees in 2.0 s: 0.21 degrees short of 90.21 (asked: 90; left by the turn before: +0.21)')


def test_what_the_law_knows_at_rest_counts_more_than_one_sample():
    turn = Turn(1.0, 0.0, 0.0, 5.0)
    assert turn.error(0.9) == pytest.approx(0.1)
    turn.end(0.02)
    assert turn.error(0.9) == 0.02
    assert turn.result(0.9, 6.0).startswith('Turned {:.2f} degrees'.format(math.degrees(0.98)))
