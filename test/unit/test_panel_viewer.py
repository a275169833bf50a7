"""A page gets its messages, in time; a page that cannot keep up is dropped."""
import json

import pytest

from tb3_labs.panel.requests import Request
from tb3_labs.panel.viewer import Viewer


def viewer_of(sent=0):
    """A page to which that many pictures were sent; its messages are kept."""
    messages = []
    viewer = Viewer(lambda text: messages.append(json.loads(text)), lambda: None)
    viewer.messages = messages
    for _ in range(sent):
        viewer.send_picture({'odom': None})
    return viewer


def test_pictures_are_numbered_from_one():
    assert viewer_of(3).messages == [
        {'type': 'picture', 'odom': None, 'n': number} for number in (1, 2, 3)]


@pytest.mark.parametrize('seen', [0, 1, 20])
def test_it_is_dropped_60_pictures_after_the_one_that_it_has_seen(seen):
    viewer = viewer_of(20)
    for number in (seen, 0):    # an older report takes nothing back
        viewer.has_seen(number)
    while viewer.sent < seen + 59:
        viewer.send_picture({})
        assert not viewer.is_too_slow
    viewer.send_picture({})
    assert viewer.is_too_slow
    viewer.has_seen(seen + 1)
    assert not viewer.is_too_slow


def test_a_picture_that_was_not_sent_cannot_be_seen():
    viewer = viewer_of(20)
    with pytest.raises(ValueError, match='picture 21 was not sent yet: the last one is 20'):
        viewer.has_seen(21)
    for _ in range(40):
        viewer.send_picture({})
    assert viewer.is_too_slow        # the invalid report does not count


def test_answers_have_the_number_of_their_request():
    viewer = viewer_of()
    viewer.answer(Request('stop', id=7), True, 'done')
    viewer.answer(Request('stop'), True, 'done')    # without a number nobody waits for it
    viewer.answer(Request('stop'), False, 'why')
    viewer.answer(None, False, 'unreadable')
    assert viewer.messages == [
        {'type': 'answer', 'id': 7, 'ok': True, 'text': 'done'},
        {'type': 'note', 'text': 'why', 'warning': True},
        {'type': 'note', 'text': 'unreadable', 'warning': True}]


def test_a_request_is_pressed_when_it_was_sent_or_earlier():
    """The page's clock is 500 s ahead of the panel's."""
    viewer = viewer_of()
    assert viewer.timed(Request('stop', sent_at=600.0), 100.0).pressed == 100.0
    late = viewer.timed(Request('give', sent_at=601.0), 101.5)
    assert (late.lateness, late.pressed) == (0.5, 101.0)
    assert viewer.timed(Request('give', sent_at=602.0, pressed=90.0), 102.0).pressed == 90.0
    assert viewer.timed(Request('give', sent_at=603.0, pressed=999.0), 103.0).pressed == 103.0
    assert viewer.timed(Request('give'), 104.0) == Request('give', pressed=104.0)
