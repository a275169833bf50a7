"""All short stories of stops and grants. Longer ones: exhaust.py."""
from dataclasses import replace

import pytest

from exhaust import search, told, walk
from played_pages import LatePages, TwoPages
from played_worlds import (
    Goals, GoneRobot, LatePad, LateTurns, MouseAndTurns, OnePad, Senders, TwoMice, TwoPads)
from tb3_labs.localization.contradiction import GyroWatch
from tb3_labs.nodes.controller.mouse_reader import Mouse
from tb3_labs.nodes.gamepad.core import GamepadCore
from tb3_labs.supervision.events import Age, Origins
from tb3_labs.supervision.freshness import Lateness, SleepWatch
from tb3_labs.supervision.goal_requests import GoalRequests
from tb3_labs.supervision.lost_or_stalled import SensorWatch


class ByY(OnePad):
    EVENTS = [event for event in OnePad.EVENTS
              if event[0] == 'Y' or event[1] in ('sleep', 'let_pass', 'hold_up') and event[-1] in (
                  0.31, 1.95, 2.15, True)]


AGE_OF, UPDATE, HEARD = Origins.age_of, SensorWatch.update, Mouse.heard


@pytest.mark.parametrize('kind, depth', [
    (Senders, 2), (OnePad, 2), (LatePad, 2), (TwoPads, 2), (TwoPages, 2), (LatePages, 3),
    (MouseAndTurns, 2), (Goals, 3), (GoneRobot, 3), (LateTurns, 4), (TwoMice, 3)])
def test_no_story_of_so_many_events_moves_a_robot_against_the_rule(kind, depth):
    found = search(kind, depth=depth)
    assert not found.story, told(found)
    assert found.drives >= 5 and found.transitions > 100    # otherwise nothing was judged


@pytest.mark.parametrize('kind', [
    Senders, OnePad, TwoPads, TwoPages, MouseAndTurns, Goals, GoneRobot, LateTurns, TwoMice])
def test_no_long_story_moves_a_robot_against_the_rule(kind):
    told_of = [walk(kind, seed) for seed in range(10)]
    assert [told(found) for found in told_of if found.story] == []
    assert sum(found.drives for found in told_of) >= 5


def never(*ages):
    """No message is found to be of these ages."""
    def age_of(self, way, now):
        age = AGE_OF(self, way, now)
        return Age.NEW if age in ages else age
    return age_of


def only_falling(self, stamp, arrival):
    """The usual delay can only fall."""
    self.least = min(getattr(self, 'least', 1e9), arrival - stamp)
    return arrival - stamp - self.least


def sleepless(self, now):
    """A sleep is not noticed."""
    self.slept_for, self.is_waking = 0.0, False


def forgetful(self, now, is_checked=True):
    """Each silence is short."""
    self.ask()
    UPDATE(self, now, is_checked)


def once(self, request):
    """A repeated goal comes back."""
    return False


def each_counts(self, *_):
    """A press is never too old."""
    return True


def one_for_all(self, message):
    """All mice are one."""
    return HEARD(self, replace(message, sender=''))


@pytest.mark.parametrize('kind, owner, method, defect, number, deeds', [
    # a latched True gives control
    (Senders, Origins, 'age_of', never(Age.OLD, Age.LATCHED), 2, 'student let_pass'),
    # only what is latched may be old
    (Senders, Origins, 'age_of', never(Age.REPEATED), 3, 'repeat start_mover let_pass'),
    # the messages of a process also bind the next process of its name
    (OnePad, Origins, 'age_of', never(Age.RESTARTED), 4, 'press end_pad let_pass'),
    (Senders, SleepWatch, 'update', sleepless, 3, 'sleep by_terminal let_pass'),
    (OnePad, Lateness, 'of', only_falling, 1, 'set_back press push'),
    (GoneRobot, SensorWatch, 'update', forgetful, 3, 'press go_and_come let_pass'),
    (LateTurns, GyroWatch, 'is_checked', True, 4, 'switch turn let_pass'),
    (Goals, GoalRequests, 'stays_ended', once, 4, 'repeat_goal cancel by_terminal let_pass'),
    (TwoMice, Mouse, 'heard', one_for_all, 5, 'sleep set let_pass'),
    # Y; a reset
    (ByY, GamepadCore, '_counts', each_counts, 3, 'sleep press let_pass'),
    (ByY, GamepadCore, '_counts', each_counts, 3, 'hold_up press let_pass'),
    (Goals, SleepWatch, 'doubt', '', 3, 'sleep reset let_pass')])
def test_a_defect_is_found_by_its_shortest_story(
        monkeypatch, kind, owner, method, defect, number, deeds):
    """Among all events it is found, too, but that takes longer."""
    monkeypatch.setattr(owner, method, defect)
    monkeypatch.setattr(kind, 'EVENTS', [
        event for event in kind.EVENTS if event[1] in deeds.split()])
    assert len(search(kind, 60.0).story) == number
