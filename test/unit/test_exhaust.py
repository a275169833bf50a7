"""All short stories of stops and givings; longer ones: exhaust.py itself, and all defects: defects.py."""
import pytest

from defects import look_for
from exhaust import search, told
from played_worlds import MouseAndTurns, OnePad, Senders, TwoPads


@pytest.mark.parametrize('kind, depth', [(Senders, 3), (OnePad, 2), (TwoPads, 2), (MouseAndTurns, 3)])
def test_no_story_of_so_many_events_moves_a_robot_against_the_rule(kind, depth):
    found = search(kind, depth=depth)
    assert not found.story, told(found)
    assert found.drives > 20 and found.transitions > 100    # otherwise nothing was judged


@pytest.mark.parametrize('name, events', [
    ('a first False that is latched is thrown away', 3),
    ('a latched True gives control', 2),
    ('the usual delay only ever falls', 1)])
def test_a_defect_is_found_by_its_shortest_story(name, events):
    found = look_for(name, 60.0)
    assert len(found.story) == events
