"""Who drives, after every event: the rule as the handout and its users would state it."""
import itertools

import pytest

from tb3_labs.arbiter import Driver, Event, who_drives

NOBODY, TURN, MOUSE = Driver.NOBODY, Driver.TURN, Driver.MOUSE

AFTER = {
    # event:               nobody  turn    mouse   was driving
    Event.TURN_ASKED:     (TURN,   TURN,   MOUSE),
    Event.TURN_OVER:      (NOBODY, NOBODY, MOUSE),
    Event.MOUSE_MOVED:    (MOUSE,  MOUSE,  MOUSE),
    Event.MOUSE_CENTRED:  (NOBODY, TURN,   NOBODY),
    Event.MOUSE_RELEASED: (NOBODY, NOBODY, NOBODY),
}


@pytest.mark.parametrize('event', Event)
def test_who_drives_after_each_event(event):
    assert tuple(who_drives(driver, event) for driver in (NOBODY, TURN, MOUSE)) == AFTER[event]


def test_released_mouse_ends_with_nobody_after_any_history():
    for history in itertools.product(Event, repeat=4):
        driver = NOBODY
        for event in history:
            driver = who_drives(driver, event)
        assert who_drives(driver, Event.MOUSE_RELEASED) is NOBODY
