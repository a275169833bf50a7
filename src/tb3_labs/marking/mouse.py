"""The mouse in the IMU lab: what is done with it, how a node must answer, and its message.

Students define the message of the mouse themselves. It may have `activestatus` for `status`, `bool`
for `std_msgs/Bool`, or an extra `zPos`. Its fields are found by name, else by type and position.
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
#: The stimulus: the mouse stops sending.
SILENT = 'mouse silent'
ALONE = (NOT_ACTIVE, UP, NEAR_MIDDLE, TO_LEFT, HALF_RIGHT, DEACTIVATED)
BESIDE_TURNS = (TURN_BESIDE, AFTER_TURN, IN_TURN)
#: The places of the active mouse: stimulus -> (x to the right, y up), each -1 to 1.
PLACES = {UP: (0.0, 1.0), NEAR_MIDDLE: (0.2, -0.2), TO_LEFT: (-1.0, 0.0), HALF_RIGHT: (0.6, 0.0)}

#: The mouse lab's dead zone: in each direction, the mouse asks for zero within this distance of the
#: middle.
DEAD_ZONE = 0.25
#: The full speed, at the edge of the screen [m/s], [rad/s].
FULL = 0.5
AT_EDGE = (FULL - NEAR, FULL + NEAR)
#: The speeds at 0.6 of the way: a wide range, since the mouse lab does not fix the dead zone.
HALF_WAY = (0.2 * FULL, 0.8 * FULL)
#: The mouse is held at a place for HELD; moved during a turn, it must drive within AT_LAST [s].
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


def steers_robot(seen: Observation) -> str:
    """'' if the active mouse steers at each of its places, else what was seen."""
    for name, column, bounds in ((UP, LINEAR, AT_EDGE), (TO_LEFT, ANGULAR, AT_EDGE),
                                 (HALF_RIGHT, ANGULAR, opposite(HALF_WAY))):
        missed = steers(seen.during(name).moving, name, column, bounds)
        if missed:
            return missed
    return ''


def has_dead_zone(seen: Observation) -> str:
    """'' if a mouse near the middle moves nothing, else what was seen."""
    _mouse_drove(seen)
    late = seen.during(NEAR_MIDDLE).moving_after(AT_ONCE)
    return '' if not len(late) else \
        'with the mouse at {} it commanded {:.2f} m/s and {:.2f} rad/s'.format(
            PLACES[NEAR_MIDDLE], *late[-1, 1:])


def can_be_off(seen: Observation) -> str:
    """'' if a mouse that is not active moves nothing, else what was seen."""
    if len(seen.during(NOT_ACTIVE).moving):
        return 'the mouse moved the robot before it was activated'
    _mouse_drove(seen)
    if len(seen.during(DEACTIVATED).moving_after(AT_ONCE)):
        return 'the robot was still driven {:g} s after the mouse was deactivated'.format(AT_ONCE)
    return ''


def drives_after_turn(seen: Observation) -> str:
    """'' if the mouse drives the robot after a turn, else what was seen."""
    return '' if drives_forward(seen.during(AFTER_TURN).commands) else \
        'after a turn the mouse did not move the robot any more'


def drives_in_turn(seen: Observation) -> str:
    """'' if a mouse that is moved in a turn drives then or after it, else what was seen."""
    scene = seen.during(IN_TURN)
    if not scene.facts[WAS_MOVING]:
        return 'there was no turn in the middle of which the mouse could be moved'
    return '' if drives_forward(scene.commands) else \
        'the mouse, moved in the middle of a turn, had not moved the robot {:.0f} s later'.format(
            scene.end - scene.begin)


def drives_forward(commands: Iterable[Sequence[float]]) -> bool:
    """Does a mouse at the upper edge give one of these commands? Rows of time, linear, angular."""
    return any(command[LINEAR] > AT_EDGE[0] for command in commands)


# -- the message

#: The mouse lab's names of the fields; FLAGS and NUMBERS are the types that they may have.
STATUS, X, Y = 'status', 'xPos', 'yPos'
FLAGS = ('bool', 'std_msgs/Bool')
NUMBERS = ('float32', 'float64', 'std_msgs/Float32', 'std_msgs/Float64')


class MouseFields(NamedTuple):
    """The names of the fields, the types of each, and sentences about names that differ."""

    names: Tuple[str, str, str]     # of status, x and y
    types: Tuple[str, str, str]
    remarks: List[str]


def mouse_fields(names: Sequence[str], types: Sequence[str]) -> MouseFields:
    """The MouseFields of a message that has fields of these names and types, in this order.

    ``ValueError`` with a clause if the message has no flag, or fewer than two numbers.
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
    """The field of this name, in any case, with or without `Pos`; None if there is none."""
    for wanted in (usual.lower(), usual.lower().replace('pos', '')):
        for name, kind in fields:
            if name.lower().replace('_', '') == wanted:
                return name, kind
    return None
