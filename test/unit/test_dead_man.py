"""The driver after every event: the rule as the handout and its users would state it."""
import pytest

from tb3_labs.nodes.controller.turns import NEXT_DRIVER, Driver, DriverEvent
from tb3_labs.supervision.control_holder import NEXT_HOLDER, ControlEvent, ControlHolder
from tb3_labs.supervision.dead_man import DeadMan
from tb3_labs.supervision.timeouts import INPUT_TIMEOUT

NOBODY, TURN, MOUSE = Driver.NOBODY, Driver.TURN, Driver.MOUSE
FREE, GAMEPAD, GOAL = ControlHolder.NOBODY, ControlHolder.GAMEPAD, ControlHolder.MOVE_TO_GOAL

DRIVER_AFTER = {
    # event:                    nobody  turn    mouse   was driving
    DriverEvent.TURN_REQUESTED: (TURN,   TURN,   MOUSE),
    DriverEvent.TURN_OVER:      (NOBODY, NOBODY, MOUSE),
    DriverEvent.MOUSE_MOVED:    (MOUSE,  MOUSE,  MOUSE),
    DriverEvent.MOUSE_CENTRED:  (NOBODY, TURN,   NOBODY),
    DriverEvent.MOUSE_RELEASED: (NOBODY, NOBODY, NOBODY),
}

HOLDER_AFTER = {
    # event:                 nobody   gamepad  move_to_goal   was holding
    ControlEvent.READY:      (GAMEPAD, GAMEPAD, GOAL),
    ControlEvent.RELINQUISH: (GOAL,    GOAL,    GOAL),
    ControlEvent.REGAIN:     (FREE,    GAMEPAD, FREE),
    ControlEvent.GRANTED:    (GOAL,    GOAL,    GOAL),
    ControlEvent.TAKEN:      (FREE,    GAMEPAD, FREE),
    ControlEvent.STOPPED:    (FREE,    FREE,    GOAL),
    ControlEvent.LOST:       (FREE,    FREE,    FREE),
}


@pytest.mark.parametrize('event', [*DriverEvent, *ControlEvent])
def test_the_driver_and_the_holder_after_each_event(event):
    for rule, before, now in ((NEXT_DRIVER, (NOBODY, TURN, MOUSE), DRIVER_AFTER),
                              (NEXT_HOLDER, (FREE, GAMEPAD, GOAL), HOLDER_AFTER)):
        if event in now:
            assert tuple(rule.get((who, event), who) for who in before) == now[event]


# Which page drives: the one that gripped first; after a stop, a person must grip again -------------

A, B = 'page a', 'page b'


@pytest.fixture
def dead_man():
    """Page a drives; its last message is of 100.0 s."""
    dead_man = DeadMan()
    assert dead_man.hold(A, 0, 100.0, 0.0, True)
    return dead_man


def test_one_page_drives_until_the_person_lets_go(dead_man):
    with pytest.raises(ValueError, match='another page drives'):
        dead_man.hold(B, 0, 100.1, 0.0, True)
    assert not dead_man.let_go(B) and dead_man.driving_page is A
    assert dead_man.let_go(A) and dead_man.driving_page is None
    assert dead_man.hold(B, 0, 100.2, 0.0, True) and dead_man.driving_page is B


def test_after_a_stop_earlier_acts_of_a_person_are_rejected(dead_man):
    dead_man.stop()
    assert dead_man.driving_page is None and dead_man.stops == 1
    for known, first, reason in ((0, False, 'stopped'), (0, True, 'stopped'), (None, True, 'stopped'),
                                 (1, False, 'came late')):
        with pytest.raises(ValueError, match=reason):
            dead_man.hold(A, known, 100.1, 0.0, first)
    with pytest.raises(ValueError, match='stopped'):
        dead_man.refuse_if_old(0, 100.1, 0.0, 1.0)
    dead_man.refuse_if_old(1, 100.1, 1.0, 1.0)
    with pytest.raises(ValueError, match='this came 1.1 s late'):
        dead_man.refuse_if_old(1, 100.1, 1.1, 1.0)
    assert dead_man.hold(A, 1, 100.1, 0.0, True)


@pytest.mark.parametrize('late', [False, True])
def test_a_page_that_is_silent_or_late_is_lost(dead_man, late):
    if late:
        assert not dead_man.hold(A, 0, 100.2, INPUT_TIMEOUT + 1e-9, False)    # as if it had not come
    assert dead_man.driving_page_lost_for(100.0 + INPUT_TIMEOUT) == 0.0
    assert dead_man.driving_page_lost_for(100.3) == pytest.approx(0.3)
