"""A page that cannot keep up is dropped, one that can is not."""
import re
from pathlib import Path

import pytest

from tb3_labs.panel.viewer import MOST_UNSEEN, REPORT_EVERY, Viewer

PAGE = Path(__file__).resolve().parents[2] / 'src' / 'tb3_labs' / 'ros' / 'panel' / 'page'


def sent(count):
    viewer = Viewer()
    for _ in range(count):
        viewer.next_picture()
    return viewer


def test_pictures_are_numbered_from_one():
    viewer = Viewer()
    assert [viewer.next_picture() for _ in range(3)] == [1, 2, 3] and viewer.sent == 3


@pytest.mark.parametrize('count, dropped', [(0, False), (1, False), (59, False), (60, True),
                                            (1000, True)])
def test_a_page_that_never_reports_is_dropped_after_60_pictures(count, dropped):
    assert sent(count).is_too_slow is dropped


def test_the_page_reports_as_often_as_is_said_here():
    every, = re.findall(r'SEEN_EVERY = (\d+)', (PAGE / 'link.js').read_text())
    assert int(every) == REPORT_EVERY < MOST_UNSEEN / 2


@pytest.mark.parametrize('seen', [1, 10, 17, 20])
def test_it_is_dropped_60_pictures_after_the_one_that_it_has_seen(seen):
    viewer = sent(20)
    viewer.has_seen(seen)
    while viewer.sent < seen + 59:
        viewer.next_picture()
        assert not viewer.is_too_slow
    viewer.next_picture()
    assert viewer.is_too_slow
    viewer.has_seen(seen + 1)
    assert not viewer.is_too_slow


def test_a_page_that_reports_every_tenth_picture_stays():
    viewer = Viewer()
    for _ in range(1000):
        number = viewer.next_picture()
        assert not viewer.is_too_slow
        if number % 10 == 0 and number > 40:
            viewer.has_seen(number - 40)        # two seconds under way, there and back


def test_an_old_report_takes_nothing_back():
    viewer = sent(59)
    viewer.has_seen(50)
    viewer.has_seen(10)
    viewer.has_seen(0)
    for _ in range(50):
        viewer.next_picture()
    assert not viewer.is_too_slow


@pytest.mark.parametrize('count, number', [(0, 1), (20, 21), (20, 10 ** 12)])
def test_a_picture_that_was_not_sent_cannot_be_seen(count, number):
    viewer = sent(count)
    with pytest.raises(ValueError) as caught:
        viewer.has_seen(number)
    assert str(caught.value) == 'picture {} was not sent yet: the last one is {}'.format(
        number, count)
    viewer.has_seen(count)
    for _ in range(60):
        assert not viewer.is_too_slow
        viewer.next_picture()
    assert viewer.is_too_slow        # what was refused does not count
