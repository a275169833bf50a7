"""All short stories of stops and grants. Longer ones: story_search.py."""
import pytest

from story_search import CASTS, search
from tb3_labs.supervision.events import Age, MessageAges
from tb3_labs.supervision.sensors_and_stalls import SensorMonitor
from tb3_labs.supervision.timeouts import SleepMonitor

AGE_OF, UPDATE = MessageAges.age_of, SensorMonitor.update


@pytest.mark.parametrize('name', CASTS)
def test_no_story_moves_a_robot_against_the_rule(name):
    found = search(CASTS[name], depth=CASTS[name].depth)
    assert not found.story, str(found)
    assert found.drives >= 5 and found.transitions > 100    # otherwise nothing was judged


def never_old(self, way, now):
    """A mistake: a node treats no message as latched."""
    age = AGE_OF(self, way, now)
    return Age.NEW if age in (Age.OLD, Age.LATCHED) else age


def sleepless(self, now):
    """A mistake: a node does not notice a sleep."""
    self.slept_for, self.is_waking = 0.0, False


def forgetful(self, now, is_checked=True):
    """A mistake: a node measures each silence as short."""
    self.request_motion()
    UPDATE(self, now, is_checked)


@pytest.mark.parametrize('name, events, owner, method, defect, number', [
    ('terminals', 'the student says True|.* pass', MessageAges, 'age_of', never_old, 2),
    ('a sleep', '', SleepMonitor, 'update', sleepless, 3),
    ('a robot that goes', 'A of.*|.*a setting.*|.* pass', SensorMonitor, 'update', forgetful, 2)])
def test_a_defect_is_found_by_its_shortest_story(monkeypatch, name, events, owner, method, defect, number):
    """Among all events it is found, too, but that takes longer."""
    monkeypatch.setattr(owner, method, defect)
    assert len(search(CASTS[name]._replace(events=events or CASTS[name].events), 60.0).story) == number
