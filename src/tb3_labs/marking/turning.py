"""The turns of the IMU lab: by how far the robot turned, and with which commands."""
import re
from typing import NamedTuple

import numpy as np

from tb3_labs.marking.criteria import first_missed
from tb3_labs.marking.observation import MOVED, RESTED, NotSeen, Observation
from tb3_labs.marking.steering import ROUNDING

#: The letters that a person types.
LEFT, RIGHT = 'l', 'r'


class Turn(NamedTuple):
    """One turn: the letter that is typed, the angle it asks for, the heading where it begins."""

    typed: str
    asked_deg: float
    begins_deg: float


#: stimulus -> Turn
TURNS = {
    LEFT: Turn(LEFT, 90.0, 40.0),
    'l across 180': Turn(LEFT, 90.0, 130.0),
    'r across 180': Turn(RIGHT, -90.0, 220.0),
    RIGHT: Turn(RIGHT, -90.0, 130.0),
    'r across 0': Turn(RIGHT, -90.0, 40.0),
}
#: The turns where the heading jumps.
ACROSS = [name for name in TURNS if 'across' in name]
#: The stimulus of an input that is not valid, and the input.
NONSENSE = 'nonsense'
TYPED_NONSENSE = 'x'
#: The handout's tolerance, and how far a robot may go on after it was stopped [deg].
TOLERANCE, AFTER_STOP = 10.0, 1.0
#: The handout's fastest turn [rad/s].
MAX_ANG_Z = 1.5
#: A turn begins within this time after the letter was typed, and is over within this time [s].
REACTION, TURN_TIME = 3.0, 8.0
#: A person waits for an answer for this time [s], and cannot find it among more lines than this.
ANSWER, LEGIBLE = 1.0, 1000
#: The tolerance beyond the handout [deg].
EXACT = 1.0
#: What a turn is judged by, in words.
LIMITS = 'within {:g} degrees, and {:g} that a stopped robot goes on; begun within {:g} s, over ' \
    'within {:g} s'.format(TOLERANCE, AFTER_STOP, REACTION, TURN_TIME)


def turned(seen: Observation, name: str, turn: Turn,
           tolerance: float = TOLERANCE + AFTER_STOP) -> str:
    """'' if the stimulus `name` was this turn within `tolerance` [deg], else what was seen."""
    scene = seen.during(name)
    where = ' ({})'.format(name[2:]) if name in ACROSS else ''
    after = 'after {}{}'.format(turn.typed, where)
    if not scene.facts[MOVED]:
        return '{} the robot did not turn'.format(after)
    seen_deg = scene.turned_deg
    if not scene.facts[RESTED]:
        return '{} it turned {}, and was still moving after {:g} s'.format(
            after, _degrees(seen_deg), TURN_TIME)
    if abs(seen_deg - turn.asked_deg) <= tolerance:
        return ''
    missed = '{} it turned {}, then stopped'.format(after, _degrees(seen_deg))
    if seen_deg * turn.asked_deg <= 0.0:
        return missed
    return '{}: {:.1f} degrees {} the goal, where {:g} are allowed'.format(
        missed, abs(seen_deg - turn.asked_deg),
        'short of' if abs(seen_deg) < abs(turn.asked_deg) else 'beyond',
        min(tolerance, TOLERANCE))


def _degrees(seen_deg):
    number = '{:.1f}'.format(abs(seen_deg))
    if float(number) == 0.0:
        return number + ' degrees'
    return '{} degrees to the {}'.format(number, 'left' if seen_deg > 0.0 else 'right')


def left(seen: Observation) -> str:
    """Does l turn 90 degrees left?"""
    return turned(seen, LEFT, TURNS[LEFT])


def right(seen: Observation) -> str:
    """Does r turn 90 degrees right?"""
    return turned(seen, RIGHT, TURNS[RIGHT])


def short_way(seen: Observation) -> str:
    """Do they turn the same where the heading jumps?"""
    return first_missed(*(turned(seen, name, TURNS[name]) for name in ACROSS))


def within_1_deg(seen: Observation) -> str:
    """Are all turns ten times as exact as the handout asks for?"""
    return first_missed(*(turned(seen, name, turn, EXACT) for name, turn in TURNS.items()))


def _turning(seen):
    """The commands of all turns that were tried; NotSeen if there are none."""
    scenes = [seen.during(name) for name in TURNS if seen.has(name)] or [seen.during(LEFT)]
    commands = np.vstack([scene.moving for scene in scenes])
    if not len(commands):
        raise NotSeen('the robot was never turned')
    return commands


def clamped(seen: Observation) -> str:
    """Is no turn faster than MAX_ANG_Z?"""
    fastest = np.abs(_turning(seen)[:, 2]).max()
    return '' if fastest <= MAX_ANG_Z + ROUNDING else \
        'it commanded up to {:.1f} rad/s while turning'.format(fastest)


def on_the_spot(seen: Observation) -> str:
    """Is there no forward speed while turning?"""
    fastest = np.abs(_turning(seen)[:, 1]).max()
    return '' if fastest < ROUNDING else \
        'it commanded up to {:.2f} m/s forward while turning'.format(fastest)


def answers_nonsense(seen: Observation) -> str:
    """Is there an error that names the valid inputs, and no movement?"""
    scene = seen.during(NONSENSE)
    if len(scene.moving):
        return 'the robot moved after "{}" was typed'.format(TYPED_NONSENSE)
    if scene.lines > LEGIBLE:
        return 'an answer to "{}" could not be read: {} lines were printed in {:.1f} s'.format(
            TYPED_NONSENSE, scene.lines, scene.end - scene.begin)
    if not names_valid_inputs(scene.printed):
        return 'the answer to "{}" did not name both valid inputs, l and r'.format(TYPED_NONSENSE)
    return ''


def names_valid_inputs(printed: str) -> bool:
    """Does this text name l and r, or left and right, as words of their own?"""
    words = set(re.findall(r'[a-z]+', printed.lower()))
    return bool(words & {LEFT, 'left'}) and bool(words & {RIGHT, 'right'})
