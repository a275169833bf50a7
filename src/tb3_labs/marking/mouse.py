"""The mouse of the IMU lab: alone, and beside turns; and its message.

Students define the message themselves: `activestatus` for `status`, `bool` for `std_msgs/Bool`, an
extra `zPos`. Its fields are matched by name, else by type and position.
"""
from typing import Iterable, List, NamedTuple, Optional, Sequence, Tuple

from tb3_labs.marking.criteria import ANGULAR, AT_ONCE, LINEAR, NEAR, opposite, steers
from tb3_labs.marking.observation import WAS_MOVING, NotSeen, Observation

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
#: The speeds at the edge of the screen [m/s], [rad/s].
FULL = 0.5
AT_EDGE = (FULL - NEAR, FULL + NEAR)
#: The speeds at more than half the way: a wide range, as the handout leaves the dead zone open.
HALF_WAY = (0.2 * FULL, 0.8 * FULL)
#: The mouse is held at a place for this time; moved in a turn, it drives within this time [s].
HELD, AT_LAST = 0.8, 4.0
#: The limits of the criteria of the mouse, in words.
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


# ----- its message -----

#: The handout's names of the fields, and the types that will do.
STATUS, X, Y = 'status', 'xPos', 'yPos'
FLAGS = ('bool', 'std_msgs/Bool')
NUMBERS = ('float32', 'float64', 'std_msgs/Float32', 'std_msgs/Float64')


class MouseFields(NamedTuple):
    """The names of the fields, the types of each, and sentences about names that differ."""

    names: Tuple[str, str, str]     # of status, x and y
    types: Tuple[str, str, str]
    remarks: List[str]


def mouse_fields(names: Sequence[str], types: Sequence[str]) -> MouseFields:
    """The fields of the mouse in a message with these fields and types, in their order.

    ``ValueError``, a clause, if the message has no flag or fewer than two numbers.
    """
    flags = [pair for pair in zip(names, types) if pair[1] in FLAGS]
    numbers = [pair for pair in zip(names, types) if pair[1] in NUMBERS]
    if not flags or len(numbers) < 2:
        raise ValueError('its message has no flag and two numbers, but {}'.format(', '.join(
            '{} {}'.format(kind, name) for name, kind in zip(names, types)) or 'no field'))
    status = _named(STATUS, flags) or flags[0]
    x, y = _named(X, numbers), _named(Y, numbers)
    if not (x and y):
        x, y = numbers[:2]
    chosen = (status[0], x[0], y[0])
    remarks = ['Your {} was taken for {}.'.format(name, usual)
               for name, usual in zip(chosen, (STATUS, X, Y)) if name != usual]
    return MouseFields(chosen, (status[1], x[1], y[1]), remarks)


def _named(usual: str, fields: List[Tuple[str, str]]) -> Optional[Tuple[str, str]]:
    """The field of this name, in upper or lower case, also without `Pos`; None if there is none."""
    for wanted in (usual.lower(), usual.lower().replace('pos', '')):
        for name, kind in fields:
            if name.lower().replace('_', '') == wanted:
                return name, kind
    return None
