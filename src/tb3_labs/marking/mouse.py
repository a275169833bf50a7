"""The mouse of the IMU lab: alone, and beside turns."""
from typing import Iterable, Sequence

from tb3_labs.marking.observation import WAS_MOVING, NotSeen, Observation
from tb3_labs.marking.steering import ANGULAR, LINEAR, NEAR, opposite, steers
from tb3_labs.marking.stopping import AT_ONCE, stops_when_silent
from tb3_labs.marking.turning import LEFT, TURNS, turned

#: The stimuli of the mouse alone, in their order.
NOT_ACTIVE = 'mouse not active'
UP, NEAR_MIDDLE, TO_LEFT, HALF_RIGHT = (
    'mouse up', 'mouse near the middle', 'mouse left', 'mouse half right')
DEACTIVATED = 'mouse deactivated'
#: The stimuli beside turns.
TURN_BESIDE, AFTER_TURN, IN_TURN = 'l beside the mouse', 'mouse after a turn', 'mouse in a turn'
#: The stimulus of a mouse that sends no more.
SILENT = 'mouse silent'
ALONE = (NOT_ACTIVE, UP, NEAR_MIDDLE, TO_LEFT, HALF_RIGHT, DEACTIVATED)
BESIDE_TURNS = (TURN_BESIDE, AFTER_TURN, IN_TURN)
#: Where the mouse is while it is active, stimulus -> (x to the right, y up), each -1 to 1.
PLACES = {UP: (0.0, 1.0), NEAR_MIDDLE: (0.2, -0.2), TO_LEFT: (-1.0, 0.0), HALF_RIGHT: (0.6, 0.0)}

#: Nothing moves at the handout's distance from the middle; places nearer to it are tried.
DEAD_ZONE = 0.25
#: What the edge of the screen commands [m/s], [rad/s].
FULL = 0.5
AT_EDGE = (FULL - NEAR, FULL + NEAR)
#: What more than half the way commands: a wide range, as the handout leaves the dead zone open.
HALF_WAY = (0.2 * FULL, 0.8 * FULL)
#: The mouse is held at a place for this time; moved in a turn, it drives within this time [s].
HELD, AT_LAST = 0.8, 4.0
#: What the criteria of the mouse are judged by, in words.
DRIVES, DRIVES_AFTER_TURN, IN_DEAD_ZONE = (
    'within {:g} s: {:.2f} to {:.2f} at the edge, {:.2f} to {:.2f} at {:g} to the right; the other '
    'speed at most {:g}'.format(HELD, *AT_EDGE, *HALF_WAY, PLACES[HALF_RIGHT][0], NEAR),
    'more than {:.2f} m/s within {:g} s'.format(AT_EDGE[0], HELD),
    'at ({:g}, {:g}) from {:g} s on'.format(*PLACES[NEAR_MIDDLE], AT_ONCE))


def _mouse_drove(seen):
    if not len(seen.during(UP).moving):
        raise NotSeen('the mouse did not move the robot at all')


def drives(seen: Observation) -> str:
    """Is up forward, left left, and half the way about half the speed?"""
    for name, column, bounds in ((UP, LINEAR, AT_EDGE), (TO_LEFT, ANGULAR, AT_EDGE),
                                 (HALF_RIGHT, ANGULAR, opposite(HALF_WAY))):
        missed = steers(seen.during(name).moving, name, column, bounds)
        if missed:
            return missed
    return ''


def dead_zone(seen: Observation) -> str:
    """Does nothing move round the middle of the screen?"""
    _mouse_drove(seen)
    late = seen.during(NEAR_MIDDLE).moving_after(AT_ONCE)
    return '' if not len(late) else \
        'with the mouse at {} it commanded {:.2f} m/s and {:.2f} rad/s'.format(
            PLACES[NEAR_MIDDLE], *late[-1, 1:])


def off(seen: Observation) -> str:
    """Does only an active mouse drive, and is the robot stopped when it is deactivated?"""
    if len(seen.during(NOT_ACTIVE).moving):
        return 'the mouse moved the robot before it was activated'
    _mouse_drove(seen)
    if len(seen.during(DEACTIVATED).moving_after(AT_ONCE)):
        return 'the robot was still driven {:g} s after the mouse was deactivated'.format(AT_ONCE)
    return ''


def turn_beside(seen: Observation) -> str:
    """Is a turn one while the mouse is active in the middle of the screen?"""
    return turned(seen, TURN_BESIDE, TURNS[LEFT])


def after_turn(seen: Observation) -> str:
    """Does the mouse drive when a turn is over?"""
    return '' if drives_forward(seen.during(AFTER_TURN).commands) else \
        'after a turn the mouse did not move the robot any more'


def in_turn(seen: Observation) -> str:
    """Does the mouse drive at last if it was moved in the middle of a turn?"""
    scene = seen.during(IN_TURN)
    if not scene.facts[WAS_MOVING]:
        return 'there was no turn in the middle of which the mouse could be moved'
    return '' if drives_forward(scene.commands) else \
        'the mouse, moved in the middle of a turn, had not moved the robot {:.0f} s later'.format(
            scene.end - scene.begin)


def drives_forward(commands: Iterable[Sequence[float]]) -> bool:
    """Is there a command as that of a mouse at the upper edge? Rows of time, linear, angular."""
    return any(command[LINEAR] > AT_EDGE[0] for command in commands)


def lost(seen: Observation) -> str:
    """Does a mouse that falls silent stop the robot?"""
    return stops_when_silent(seen, SILENT, 'the mouse')
