"""The IMU lab: turns by keyboard, beside the mouse: what is done, and the criteria."""
import re
from functools import partial
from typing import Iterable, List, NamedTuple, Sequence, Tuple

import numpy as np

from tb3_labs.marking.labs.criteria import (
    ANGULAR, AT_ONCE, IMU_EXTRAS, IMU_SHEET, IN_TIME, LINEAR, NEAR, RARELY, ROUNDING, STOPS_AT_ONCE,
    TURN_LAB, Criterion, Place, apart, ends_cleanly, first_missed, opposite, says, seldom, starts,
    steers, stops_robot, stops_when_lost, within)
from tb3_labs.marking.trial.evidence import STILL_DEG, idle
from tb3_labs.marking.trial.observation import (
    MOVED, RESTED, WAS_MOVING, NotSeen, Observation, Scene)
from tb3_labs.marking.trial.printed import LONGEST_LINE

#: The parts of the lab.
TURNS, MOUSE, BOTH, SHUTDOWN = 'turns', 'mouse', 'both', 'shutdown'
#: The stimuli: the IMU stops sending during a turn, and the mouse.
IMU_SILENT, MOUSE_SILENT = 'IMU silent', 'mouse silent'
GOODBYE = 'Controller exiting. Halting robot.'

#: START also names the mistakes of the heading.
AT_MOUSE, START, LAW, TO_RIGHT, AT_CTRL_C = (
    Place(IMU_SHEET, TURN_LAB, step) for step in (2, 4, 5, 6, 7))

#: The letters that a person types.
LEFT, RIGHT = 'l', 'r'


class WatchedTurn(NamedTuple):
    """One turn: the letter that is typed, the angle it asks for, the heading where it begins."""

    typed: str
    asked_deg: float
    begins_deg: float


#: stimulus -> WatchedTurn
EACH_TURN = {
    LEFT: WatchedTurn(LEFT, 90.0, 40.0),
    'l across 180': WatchedTurn(LEFT, 90.0, 130.0),
    'r across 180': WatchedTurn(RIGHT, -90.0, 220.0),
    RIGHT: WatchedTurn(RIGHT, -90.0, 130.0),
    'r across 0': WatchedTurn(RIGHT, -90.0, 40.0),
}
#: The turns during which the heading jumps.
ACROSS = [name for name in EACH_TURN if 'across' in name]
#: The stimulus of an invalid input; TYPED_NONSENSE is this input.
NONSENSE = 'nonsense'
TYPED_NONSENSE = 'x'
#: TOLERANCE is the handout's. A robot may go on by AFTER_STOP after it was stopped [deg].
TOLERANCE, AFTER_STOP = 10.0, 1.0
#: The handout's fastest turn [rad/s].
MAX_ANG_Z = 1.5
#: A turn begins within TURN_REACTION after the letter was typed, and is over within TURN_TIME [s].
TURN_REACTION, TURN_TIME = 3.0, 8.0
#: A person waits for an answer for ANSWER [s], and finds it among at most LEGIBLE lines.
ANSWER, LEGIBLE = 1.0, 1000
#: The tolerance of the criterion beyond the handout [deg].
EXACT = 1.0
#: The stimuli of the mouse alone, in their order, and those beside turns.
MOUSE_ALONE = NOT_ACTIVE, MOUSE_UP, NEAR_MIDDLE, MOUSE_LEFT, HALF_RIGHT, DEACTIVATED = (
    'mouse not active', 'mouse up', 'mouse near the middle', 'mouse left', 'mouse half right',
    'mouse deactivated')
BESIDE_TURNS = TURN_BESIDE, AFTER_TURN, IN_TURN = (
    'l beside the mouse', 'mouse after a turn', 'mouse in a turn')
#: The places of the active mouse: stimulus -> (x to the right, y up), each -1 to 1.
MOUSE_PLACES = {MOUSE_UP: (0.0, 1.0), NEAR_MIDDLE: (0.2, -0.2), MOUSE_LEFT: (-1.0, 0.0),
                HALF_RIGHT: (0.6, 0.0)}
#: The full speed, at the edge of the screen [m/s], [rad/s].
FULL = 0.5
AT_EDGE = (FULL - NEAR, FULL + NEAR)
#: The speeds at 0.6 of the way: a wide range, since the mouse lab does not fix the dead zone.
HALF_WAY = (0.2 * FULL, 0.8 * FULL)
#: The mouse is held at a place for MOUSE_HELD; moved in a turn, it must drive within AT_LAST [s].
MOUSE_HELD, AT_LAST = 0.8, 4.0
#: The limits of the mouse, and of the turns, in words.
DRIVES = 'within {:g} s: {:.2f} to {:.2f} at the edge, {:.2f} to {:.2f} at {:g} to the right; ' \
    'the other speed at most {:g}'.format(
        MOUSE_HELD, *AT_EDGE, *HALF_WAY, MOUSE_PLACES[HALF_RIGHT][0], NEAR)
TURN_LIMITS = 'within {:g} degrees, and {:g} for stopping; begun within {:g} s, over within ' \
    '{:g} s'.format(TOLERANCE, AFTER_STOP, TURN_REACTION, TURN_TIME)
AS_LEFT = 'as left'


def turned(seen: Observation, name: str, tolerance: float = TOLERANCE + AFTER_STOP) -> str:
    """'' if the robot did a turn, the stimulus `name`, within `tolerance` [deg], else a clause."""
    scene, turn = seen.during(name), EACH_TURN[name[0]]     # a name begins with its letter
    after = 'after {}{}'.format(turn.typed, ' ({})'.format(name[2:]) if name in ACROSS else '')
    seen_deg = scene.turned_deg
    if not scene.facts[MOVED]:
        return '{} {}: {}'.format(after, 'the robot did not turn' if abs(seen_deg) < STILL_DEG else
                                  'it turned {}'.format(_degrees(seen_deg)), idle(scene))
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


def _turned_each(seen: Observation, names: Sequence[str], *tolerance: float) -> str:
    return first_missed(*(turned(seen, name, *tolerance) for name in names))


def _turning(seen):
    """The commands of all turns that were tried; NotSeen if there are none."""
    scenes = [seen.during(name) for name in EACH_TURN if seen.has(name)] or [seen.during(LEFT)]
    commands = np.vstack([scene.moving for scene in scenes])
    if not len(commands):
        raise NotSeen('the robot was never turned')
    return commands


def _clamped(seen: Observation) -> str:
    rates = _turning(seen)[:, ANGULAR]
    fast = ['{:.1f} rad/s to the {}'.format(rate, way) for rate, way in (
        (rates.max(), 'left'), (-rates.min(), 'right')) if rate > MAX_ANG_Z + ROUNDING]
    return '' if not fast else 'while turning it commanded up to {}'.format(' and '.join(fast))


def _on_the_spot(seen: Observation) -> str:
    fastest = np.abs(_turning(seen)[:, 1]).max()
    return '' if fastest < ROUNDING else \
        'it commanded up to {:.2f} m/s forward while turning'.format(fastest)


def _answers_nonsense(seen: Observation) -> str:
    scene = seen.during(NONSENSE)
    if len(scene.moving):
        return 'the robot moved after "{}" was typed'.format(TYPED_NONSENSE)
    if scene.lines > LEGIBLE:
        return 'an answer to "{}" could not be read: {} lines were printed in {:.1f} s'.format(
            TYPED_NONSENSE, scene.lines, scene.end - scene.begin)
    words = set(re.findall(r'[a-z]+', scene.printed.lower()))
    if not (words & {LEFT, 'left'} and words & {RIGHT, 'right'}):
        return 'the answer to "{}" did not name both valid inputs, l and r'.format(TYPED_NONSENSE)
    return ''


def _mouse_drove(seen):
    if not len(seen.during(MOUSE_UP).moving):
        raise NotSeen('the mouse did not move the robot at all')


def _steers_robot(seen: Observation) -> str:
    return (steers(seen, MOUSE_UP, LINEAR, AT_EDGE, True)
            or steers(seen, MOUSE_LEFT, ANGULAR, AT_EDGE, True)
            or steers(seen, HALF_RIGHT, ANGULAR, opposite(HALF_WAY), True))


def _has_dead_zone(seen: Observation) -> str:
    _mouse_drove(seen)
    late = seen.during(NEAR_MIDDLE).moving_after(AT_ONCE)
    return '' if not len(late) else \
        'with the mouse at {} it commanded {:.2f} m/s and {:.2f} rad/s'.format(
            MOUSE_PLACES[NEAR_MIDDLE], *late[-1, 1:])


def _can_be_off(seen: Observation) -> str:
    if len(seen.during(NOT_ACTIVE).moving):
        return 'the mouse moved the robot before it was activated'
    _mouse_drove(seen)
    if len(seen.during(DEACTIVATED).moving_after(AT_ONCE)):
        return 'the robot was still driven {:g} s after the mouse was deactivated'.format(AT_ONCE)
    return ''


def _drives_after_turn(seen: Observation) -> str:
    return '' if drives_forward(seen.during(AFTER_TURN).commands) else \
        'after a turn the mouse did not move the robot any more'


def _drives_in_turn(seen: Observation) -> str:
    scene = seen.during(IN_TURN)
    if not scene.facts[WAS_MOVING]:
        return 'there was no turn in the middle of which the mouse could be moved'
    return '' if drives_forward(scene.commands) else \
        'the mouse, moved in the middle of a turn, had not moved the robot {:.0f} s later'.format(
            scene.end - scene.begin)


def drives_forward(commands: Iterable[Sequence[float]]) -> bool:
    """Does a mouse at the upper edge give one of these commands? Rows of time, linear, angular."""
    return any(command[LINEAR] > AT_EDGE[0] for command in commands)


#: Near to an angle [deg]. A robot that turns away from its goal comes at least AWAY far [deg]. A
#: node whose turn is over at once sends at most FEW zeros.
NEARLY, AWAY, FEW = 15.0, 45.0, 5
NO_RIGHT = 'A turn to the right is over at once, one to the left is not: is there a branch for ' \
    'r, as for l? Any negative error is less than HDG_TOL (abs).'


def hint(seen: Observation) -> str:
    """What a node may do that turns wrongly; '' if that is not known."""
    each_turn = tried(seen)
    turns = [(turn, scene) for turn, scene in each_turn if len(scene.moving)]
    words = _why_no_turn(each_turn) if len(turns) < len(each_turn) else ''
    if turns and not words:
        words = _why_wrong(turns)
    return words and '{} See {}.'.format(words, TO_RIGHT if words == NO_RIGHT else LAW)


def tried(seen: Observation) -> List[Tuple[WatchedTurn, Scene]]:
    """The turns that were tried."""
    return [(turn, seen.during(name, may_die=True)) for name, turn in EACH_TURN.items()
            if seen.has(name)]


def is_wrong(turn: WatchedTurn, scene: Scene) -> bool:
    """Did the robot miss the goal of a turn, or go on?"""
    return not scene.facts[RESTED] or (
        abs(scene.turned_deg - turn.asked_deg) > TOLERANCE + AFTER_STOP)


def _why_no_turn(tried):
    """Of turns of which some did not begin."""
    still = [(turn, scene) for turn, scene in tried if not len(scene.moving)]
    if all(scene.run.printed.startswith(turn.typed) for turn, scene in still):
        return 'It had not asked for a letter after {:.0f} s: is there a Timer, and how often ' \
            'does it call callback_controller? Duration(.1) is ten times a second, Duration(10) ' \
            'is every 10 s.'.format(max(scene.end - scene.run.begin for _, scene in still))
    if not all(len(scene.commands) for _, scene in still) or any(scene.odd for _, scene in tried):
        return ''
    answers = [scene.printed.splitlines()[1:-1] for _, scene in still]
    if all(answers):        # between the letter and the prompt
        return '{} is answered by {!r}: with what is the letter compared?'.format(
            still[0][0].typed, answers[0][0][:LONGEST_LINE])
    if len(still) == len(tried):
        return 'Its commands go on, all of them zero: which field of the Twist turns the robot, ' \
            'and is it set?' if min(len(scene.commands) for _, scene in still) > FEW else \
            'Its turn is over at once: is self.turning True after the letter, and is the angle ' \
            'that it adds in degrees, as HDG_TOL is?'
    if {turn.typed for turn, _ in still} == {RIGHT}:
        return NO_RIGHT
    return 'Only zeros followed its first turn: does turning become False at the goal, so that ' \
        'the next letter is read?' if len(tried[0][1].moving) else ''


def _why_wrong(turns):
    """Of turns that began; the first of these that fits."""
    if not any(scene.moving[:, ANGULAR].any() for _, scene in turns):
        return 'It commands linear.x alone, and no angular.z: which of them turns the robot?'
    pause = seldom(scene for _, scene in turns)
    if pause:
        return 'Its commands come every {:.1f} s: is there a sleep in callback_controller, or is ' \
            'its Timer as slow? The robot turns by up to {:.0f} degrees meanwhile.'.format(
                pause, np.degrees(pause * MAX_ANG_Z))
    wrong = [each for each in turns if is_wrong(*each)]
    if not wrong:
        return ''
    if all(len(scene.commands) and scene.commands[-1, ANGULAR]
           and scene.end - scene.commands[-1, 0] > RARELY for _, scene in wrong):
        return 'No zero follows its last command: which message shall be the last one of a turn?'
    return _where_it_ends(turns) or _which_way(wrong)


def _which_way(wrong):
    """What the ways say by which wrong turns begin and go on; '' if they say nothing."""
    asked, turned = np.array([(turn.asked_deg, scene.turned_deg) for turn, scene in wrong]).T
    restless = sum(not scene.facts[RESTED] for _, scene in wrong)
    if all(scene.moving[0, ANGULAR] * turn.asked_deg < 0.0 for turn, scene in wrong):
        if restless > 1 and (turned * np.sign(asked) < -AWAY).all():
            return 'It turns away from the goal, and comes to no rest. Turn it to the left by ' \
                'hand: if self.curr_yaw grows, is the error goal minus heading, and K_HDG ' \
                'positive? If it falls, step 4 has the heading.'
        if len(wrong) > 1 and (np.abs(np.abs(turned) - np.abs(asked)) < NEARLY).all():
            return 'It turns to the other side: to the left the heading grows, to the right it ' \
                'falls.'
    return 'It comes to its goal, and goes on to and fro: is HDG_TOL 10, and the turn over ' \
        'within it?' if restless and (np.abs(turned - asked) < 2.0 * NEARLY).all() else ''


def _where_it_ends(turns):
    """What the headings say at which turns end, and the angles; '' if they say nothing."""
    if len(turns) < 3 or not all(scene.facts[RESTED] for _, scene in turns):
        return ''
    begins, asked, turned = np.array([
        (turn.begins_deg, turn.asked_deg, scene.turned_deg) for turn, scene in turns]).T
    if (np.abs(apart(begins + turned, 0.0)) < NEARLY).all():
        return 'Each turn ends at the heading 0, which self.goal_yaw has from the beginning: is ' \
            'the goal of the letter stored in self.goal_yaw?'
    if (np.abs(apart(begins + turned, asked)) < NEARLY).all():
        return 'Each l ends at the heading 90, each r at 270, wherever it began: does the goal ' \
            'count from self.curr_yaw?'
    mean = np.abs(turned).mean()
    is_half = abs(mean - 180.0) < NEARLY       # its side is chance
    if np.ptp(np.abs(turned)) > NEARLY or abs(mean - 90.0) < NEARLY or (
            not is_half and (turned * asked < 0.0).any()):
        return ''
    return 'Each turn is one of {:.0f} degrees: which angle does a letter add to self.curr_yaw{}' \
        '?'.format(mean, ', and is HDG_TOL 10' if mean < 90.0 else '')


CRITERIA = [
    Criterion('starts', TURNS, 'runs and listens to imu', START, starts, limits=IN_TIME),
    Criterion('left', TURNS, 'l turns 90 degrees left', LAW, partial(turned, name=LEFT),
              limits=TURN_LIMITS),
    Criterion('right', TURNS, 'r turns 90 degrees right', TO_RIGHT, partial(turned, name=RIGHT),
              limits=AS_LEFT),
    Criterion('short_way', TURNS, 'turns the same across 180 and 0 degrees', LAW,
              lambda seen: _turned_each(seen, ACROSS), limits=AS_LEFT),
    Criterion('clamped', TURNS, 'turns no faster than {:g} rad/s'.format(MAX_ANG_Z), LAW,
              _clamped, limits='and {:g} for rounding'.format(ROUNDING)),
    Criterion('on_the_spot', TURNS, 'does not drive forward while it turns', LAW,
              _on_the_spot, limits='less than {:g} m/s'.format(ROUNDING)),
    Criterion('answers_nonsense', TURNS, 'answers any other input by an error that names the valid '
              'ones', TO_RIGHT, _answers_nonsense, limits='within {:g} s, in at most {} lines; '
              'the robot rests'.format(ANSWER, LEGIBLE)),
    Criterion('mouse_drives', MOUSE, 'mouse up drives forward, left turns left, {:g} at the '
              'edge'.format(FULL), AT_MOUSE, _steers_robot, limits=DRIVES),
    Criterion('mouse_dead_zone', MOUSE, 'a mouse within 0.25 of the middle moves nothing',
              AT_MOUSE, _has_dead_zone, limits='at ({:g}, {:g}) from {:g} s on'.format(
                  *MOUSE_PLACES[NEAR_MIDDLE], AT_ONCE)),
    Criterion('mouse_off', MOUSE, 'the robot stops at once when the mouse is deactivated',
              AT_MOUSE, _can_be_off, limits=STOPS_AT_ONCE),
    Criterion('turn_beside_mouse', BOTH, 'turns also while the mouse is active in the middle',
              AT_MOUSE, partial(turned, name=TURN_BESIDE), limits=AS_LEFT),
    Criterion('mouse_after_turn', BOTH, 'the mouse drives after a turn', AT_MOUSE,
              _drives_after_turn,
              limits='more than {:.2f} m/s within {:g} s'.format(AT_EDGE[0], MOUSE_HELD)),
    Criterion('mouse_in_turn', BOTH, 'a mouse moved during a turn drives then or after it',
              AT_MOUSE, _drives_in_turn, limits=within(AT_LAST)),
    Criterion('stops_robot', SHUTDOWN, 'at Ctrl+C in a turn sends zero velocity', AT_CTRL_C,
              stops_robot, limits=STOPS_AT_ONCE),
    Criterion('says_goodbye', SHUTDOWN, 'at Ctrl+C says "{}"'.format(GOODBYE), AT_CTRL_C,
              partial(says, words=GOODBYE)),
    ends_cleanly(SHUTDOWN, AT_CTRL_C),
    Criterion('within_1_deg', TURNS, 'all turns are within {:g} degree'.format(EXACT), IMU_EXTRAS,
              lambda seen: _turned_each(seen, list(EACH_TURN), EXACT), extra=True),
    stops_when_lost('lost_imu', 'stops a turn', 'the IMU', IMU_SILENT, IMU_EXTRAS),
    stops_when_lost('lost_mouse', 'stops the robot', 'the mouse', MOUSE_SILENT, IMU_EXTRAS),
]
