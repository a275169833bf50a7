"""All short stories of stops and grants. Longer ones: story_search.py."""
import pytest

from story_search import CASTS, search
from tb3_labs.supervision.timeouts import SleepMonitor


@pytest.mark.parametrize('name', CASTS)
def test_no_story_moves_a_robot_against_the_rule(name):
    found = search(CASTS[name], depth=CASTS[name].depth)
    assert not found.story, str(found)
    assert found.drives >= 5 and found.transitions > 100    # otherwise nothing was judged


def test_a_defect_is_found_by_its_shortest_story(monkeypatch):
    """The node does not notice that it slept, so that a True counts which was sent before."""
    def never_sleeps(watch, _now):
        watch.slept_for, watch.is_waking = 0.0, False
    monkeypatch.setattr(SleepMonitor, 'update', never_sleeps)
    assert len(search(CASTS['a sleep'], 60.0).story) == 3
