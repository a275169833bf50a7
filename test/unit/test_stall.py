"""A robot that is told to move: stalled, driven past its goal, or never at rest."""
import pytest

from tb3_labs.supervision.motion_monitors import MAX_RETREAT, STALL_STEP, StallMonitor
from tb3_labs.supervision.timeouts import MAX_REST_TIME, STALL_TIME

DT = 0.1
STUCK, MISSED, UNSETTLED = 'does not move', 'has missed it', 'does not settle'


def after(progress, seconds, remaining, rests=True, **told):
    for k in range(round(seconds / DT)):
        problem = progress.update(
            remaining(k * DT) if callable(remaining) else remaining, rests, DT, **told)
    return problem


@pytest.mark.parametrize('rests, words', [(True, STUCK), (False, MISSED)])
def test_a_robot_that_gets_no_nearer_is_stuck_or_has_missed_its_goal(rests, words):
    progress = StallMonitor()
    assert after(progress, STALL_TIME - DT, 1.0, rests) == ''
    assert words in after(progress, 4 * DT, 1.0, rests)


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_a_robot_that_gets_nearer_in_time_has_no_problem(sign):
    slowly = 1.1 * STALL_STEP / (STALL_TIME - 2 * DT)
    assert after(StallMonitor(), 20.0, lambda time: sign * (1.0 - slowly * time), False) == ''


def test_a_robot_that_goes_away_has_missed_its_goal_at_once():
    progress = StallMonitor()
    progress.update(0.1, False, DT)
    assert progress.update(0.1 + MAX_RETREAT, False, DT) == ''
    assert MISSED in progress.update(0.11 + MAX_RETREAT, False, DT)


def test_a_robot_may_rest_for_a_limited_time():
    progress = StallMonitor()
    assert after(progress, MAX_REST_TIME - DT, 1.0, must_move=False) == ''
    assert UNSETTLED in after(progress, 3 * DT, 1.0, must_move=False)
