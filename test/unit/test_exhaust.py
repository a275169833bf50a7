"""All short stories of stops and givings. Longer ones: exhaust.py; all defects: defects.py."""
import pytest

from defects import look_for
from exhaust import search, told, walk
from played_pages import LatePages, TwoPages
from played_worlds import LatePad, MouseAndTurns, OnePad, Senders, TwoPads


@pytest.mark.parametrize('kind, depth', [
    (Senders, 2), (OnePad, 2), (LatePad, 2), (TwoPads, 2), (TwoPages, 2), (LatePages, 3),
    (MouseAndTurns, 2)])
def test_no_story_of_so_many_events_moves_a_robot_against_the_rule(kind, depth):
    found = search(kind, depth=depth)
    assert not found.story, told(found)
    assert found.drives >= 5 and found.transitions > 100    # otherwise nothing was judged


@pytest.mark.parametrize('kind', [Senders, OnePad, TwoPads, TwoPages, MouseAndTurns])
def test_no_long_story_moves_a_robot_against_the_rule(kind):
    told_of = [walk(kind, seed) for seed in range(10)]
    assert [told(found) for found in told_of if found.story] == []
    assert sum(found.drives for found in told_of) >= 5


@pytest.mark.parametrize('name, events', [
    ('a latched True gives control', 2),
    ('a page that is silent is not lost', 3),
    ('the usual delay only ever falls', 1)])
def test_a_defect_is_found_by_its_shortest_story(name, events):
    found = look_for(name, 60.0)
    assert len(found.story) == events
