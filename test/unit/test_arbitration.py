"""The driver after every event: the rule as the handout and its users would state it."""
import pytest

from tb3_labs.supervision.arbitration import (DRIVERS, HOLDERS, Arrival, Arrivals, Driver,
                                               DriverEvent, Holder, HolderEvent, after)

NOBODY, TURN, MOUSE = Driver.NOBODY, Driver.TURN, Driver.MOUSE
FREE, GAMEPAD, GOAL = Holder.NOBODY, Holder.GAMEPAD, Holder.MOVE_TO_GOAL

DRIVER_AFTER = {
    # event:                    nobody  turn    mouse   was driving
    DriverEvent.TURN_ASKED:     (TURN,   TURN,   MOUSE),
    DriverEvent.TURN_OVER:      (NOBODY, NOBODY, MOUSE),
    DriverEvent.MOUSE_MOVED:    (MOUSE,  MOUSE,  MOUSE),
    DriverEvent.MOUSE_CENTRED:  (NOBODY, TURN,   NOBODY),
    DriverEvent.MOUSE_RELEASED: (NOBODY, NOBODY, NOBODY),
}


@pytest.mark.parametrize('event', DriverEvent)
def test_who_drives_after_each_event(event):
    drivers = tuple(after(DRIVERS, driver, event) for driver in (NOBODY, TURN, MOUSE))
    assert drivers == DRIVER_AFTER[event]


HOLDER_AFTER = {
    # event:                 nobody   gamepad  move_to_goal   was holding
    HolderEvent.READY:      (GAMEPAD, GAMEPAD, GOAL),
    HolderEvent.RELINQUISH: (GOAL,    GOAL,    GOAL),
    HolderEvent.REGAIN:     (FREE,    GAMEPAD, FREE),
    HolderEvent.GIVEN:      (GOAL,    GOAL,    GOAL),
    HolderEvent.TAKEN:      (FREE,    GAMEPAD, FREE),
    HolderEvent.STOPPED:    (FREE,    FREE,    GOAL),
    HolderEvent.LOST:       (FREE,    FREE,    FREE),
}


@pytest.mark.parametrize('event', HolderEvent)
def test_who_holds_after_each_event(event):
    holders = tuple(after(HOLDERS, holder, event) for holder in (FREE, GAMEPAD, GOAL))
    assert holders == HOLDER_AFTER[event]


@pytest.mark.parametrize('cancel, ended', [
    ((), 'present a b c'), (('a',), 'a'), (('', 20), 'present a b'), (('c', 10), 'present a c'),
    (('nobody',), '')])
def test_a_cancel_ends_what_arrived_before_it_wherever_it_waits(cancel, ended):
    goals = {name: Arrival(5.0, name, stamp) for name, stamp in (
        ('present', 5), ('a', 10), ('b', 20), ('c', 30))}
    arrivals = Arrivals(goals['present'])
    for name in 'abc':
        arrivals.add(goals[name])
    assert arrivals.cancel(*cancel) is ('present' in ended)
    assert [name for name in 'abc' if goals[name].objection(5.0)] == [
        name for name in 'abc' if name in ended.split()]
    late = Arrival(5.1)
    arrivals.add(late)
    assert not late.objection(7.0) and 'it waited for 2.5 s' in late.objection(7.6)
    arrivals.accept(late)
    assert arrivals.present is late and all(goals[name].objection(5.0) for name in 'abc')
