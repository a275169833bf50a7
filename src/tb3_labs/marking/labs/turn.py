"""The stimuli and the criteria of the IMU lab: turns by keyboard, driving by mouse."""
import re
from functools import partial
from typing import Iterable, List, NamedTuple, Sequence

import numpy as np

from tb3_labs.handout import (
    CONTROLLER_GOODBYE, HDG_TOL, LEFT_KEY, MAX_ANG_Z, MOUSE_DEAD_ZONE, MOUSE_FULL, RIGHT_KEY,
    TURN_DEG)
from tb3_labs.marking.labs.criteria import (
    ANGULAR, AT_ONCE, IMU_EXTRAS, IN_TIME, LINEAR, NEAR, NO_ZERO, ROUNDING, STOPS_AT_ONCE,
    Criterion, Reason, ends_cleanly, not_stopped, prints, starts, steers, stops_robot,
    stops_when_lost, times, within)
from tb3_labs.marking.trial.observation import MOVED, RESTED, WAS_MOVING, NotObserved, Observation
from tb3_labs.marking.trial.remarks import STILL_DEG, why_idle
from tb3_labs.watch.chains import TURN_LAB
from tb3_labs.watch.input_links import TURN_BESIDE_MOUSE

#: The parts of the lab.
TURNS, MOUSE, BOTH, SHUTDOWN = 'turns', 'mouse', 'both', 'shutdown'
#: The stimuli in which a device falls silent: the IMU in a turn, the mouse in a drive.
IMU_SILENT, MOUSE_SILENT = 'IMU silent', 'mouse silent'

#: Places in the sheet. Step 4 (START) also names the mistakes of the heading.
AT_MOUSE, START, LAW, TO_RIGHT, AT_CTRL_C = (
    TURN_LAB.at_step(step) for step in (2, 4, 5, 6, 7))


class TurnStimulus(NamedTuple):
    """One turn: the typed letter, the requested angle, the heading at its begin [deg], and the
    slip: the share of the wheels' travel that is lost."""

    typed: str
    requested_deg: float
    begins_deg: float
    slip: float = 0.0


#: The slip of a carpet. A node that turns for a fixed time turns too little on it.
SLIPPERY = 0.3
#: stimulus -> TurnStimulus
TURN_STIMULI = {
    LEFT_KEY: TurnStimulus(LEFT_KEY, TURN_DEG, 40.0),
    'l across 180': TurnStimulus(LEFT_KEY, TURN_DEG, 130.0),
    'r across 180': TurnStimulus(RIGHT_KEY, -TURN_DEG, 220.0, SLIPPERY),
    RIGHT_KEY: TurnStimulus(RIGHT_KEY, -TURN_DEG, 130.0, SLIPPERY),
    'r across 0': TurnStimulus(RIGHT_KEY, -TURN_DEG, 40.0, SLIPPERY),
    'l across 0': TurnStimulus(LEFT_KEY, TURN_DEG, -50.0, SLIPPERY),
}
#: The turns in which the heading jumps, from 180 to -180 or from 360 to 0 degrees.
ACROSS = [name for name in TURN_STIMULI if 'across' in name]
#: The stimulus of an invalid input, and this input.
NONSENSE, TYPED_NONSENSE = 'nonsense', 'x'
#: A stopped robot may coast by this angle [deg].
AFTER_STOP = 1.0
#: A turn begins within TURN_REACTION after its letter was typed, and ends within TURN_TIME [s].
TURN_REACTION, TURN_TIME = 3.0, 8.0
#: A node that sends a zero for each message of a mouse at rest turns more slowly beside the mouse,
#: since these zeros come between the commands of the turn. Such a turn may take longer [s].
BESIDE_TIME = 2.0 * TURN_TIME
#: An answer to an invalid input comes within ANSWER [s], in at most LEGIBLE lines.
ANSWER, LEGIBLE = 1.0, 1000
#: The tolerance of the criterion beyond the handout [deg].
EXACT = 1.0
#: The stimuli of the mouse alone, in their order, and of the mouse beside turns.
MOUSE_ALONE = NOT_ACTIVE, MOUSE_UP, NEAR_MIDDLE, MOUSE_LEFT, HALF_WAY, DEACTIVATED = (
    'mouse not active', 'mouse up', 'mouse near the middle', 'mouse left',
    'mouse half right and half down', 'mouse deactivated')
BESIDE_TURNS = TURN_BESIDE, AFTER_TURN, IN_TURN = (
    TURN_BESIDE_MOUSE, 'mouse after a turn', 'mouse in a turn')
#: The places of the active mouse: stimulus -> (x to the right, y up), each -1 to 1.
MOUSE_PLACES = {MOUSE_UP: (0.0, 1.0), NEAR_MIDDLE: (0.2, -0.2), MOUSE_LEFT: (-1.0, 0.0),
                HALF_WAY: (0.6, -0.6)}
NO_CLIENT = 'A mouse at the upper edge, y = 1, drives backward. That is right if your mouse ' \
    'client counts y down; none was found.'
COUNTS_DOWN = 'Your mouse client counts y down, so the check does: up is y = -1.'
#: The speeds at the edge of the screen [m/s], [rad/s].
AT_EDGE = (MOUSE_FULL - NEAR, MOUSE_FULL + NEAR)
#: The speeds at 0.6 of the way to the edge. The range is wide, since the mouse lab does not say how
#: a speed begins at the dead zone.
AT_HALF = (0.2 * MOUSE_FULL, 0.8 * MOUSE_FULL)
#: The mouse is held at a place for MOUSE_HELD [s]. If the mouse is moved in a turn, the robot must
#: drive by the mouse within AT_LAST [s].
MOUSE_HELD, AT_LAST = 0.8, 4.0
#: The limits of the mouse, and of the turns, in words.
DRIVES = 'within {:g} s: {:.2f} to {:.2f} at the edge, the other speed at most {:g}; both {:.2f} ' \
    'to {:.2f} at ({:g}, {:g})'.format(
        MOUSE_HELD, *AT_EDGE, NEAR, *AT_HALF, *MOUSE_PLACES[HALF_WAY])
TURN_LIMITS = 'within {:g} degrees, and {:g} for stopping; begun within {:g} s, over within ' \
    '{:g} s, by a zero velocity'.format(HDG_TOL, AFTER_STOP, TURN_REACTION, TURN_TIME)
ON_A_CARPET = f'as left, also if the wheels slip by {SLIPPERY:.0%}'


def turned(observation: Observation, name: str, tolerance: float = HDG_TOL + AFTER_STOP,
           seconds: float = TURN_TIME) -> Reason:
    """Judges whether the robot made the turn `name` within `tolerance` [deg] and `seconds` [s]."""
    scene, turn = observation.scene(name), TURN_STIMULI.get(name, TURN_STIMULI[LEFT_KEY])
    after = f'after {turn.typed} ({name[2:]})' if name in ACROSS else f'after {turn.typed}'
    observed_deg, it_turned = scene.turned_deg, f'it turned {_degrees(scene.turned_deg)}'
    if not scene.facts[MOVED]:
        seen = 'the robot did not turn' if abs(observed_deg) < STILL_DEG else it_turned
        return f'{after} {seen}: {why_idle(scene)}'
    if not scene.facts[RESTED]:
        return f'{after} {it_turned}, and was still moving after {seconds:g} s'
    error = abs(observed_deg - turn.requested_deg)
    if error <= tolerance:
        return NO_ZERO.format('its turn ' + after) if scene.commands[-1:, 1:].any() else ''
    missed = f"{after}{', where the wheels slip,' if turn.slip else ''} {it_turned}, then stopped"
    if observed_deg * turn.requested_deg <= 0.0:
        return missed
    side = 'short of' if abs(observed_deg) < abs(turn.requested_deg) else 'beyond'
    return (f'{missed}: {error:.1f} degrees {side} the goal, where '
            f'{min(tolerance, HDG_TOL):g} are allowed')


def _degrees(observed_deg):
    number = f'{abs(observed_deg):.1f}'
    if float(number) == 0.0:
        return number + ' degrees'
    return f"{number} degrees to the {'left' if observed_deg > 0.0 else 'right'}"


def _turned_each(observation: Observation, names: Iterable[str], *tolerance: float) -> Reason:
    """Returns the Reason of the first turn that is wrong, see `turned`; '' if all are right."""
    return next(filter(None, (turned(observation, name, *tolerance) for name in names)), '')


def _commands_of_turns(observation):
    """Returns the commands of all turns that were tried; NotObserved if there are none."""
    commands = np.vstack([turn.moving for turn in observation.scenes(list(TURN_STIMULI))])
    if not len(commands):
        raise NotObserved('the robot was never turned')
    return commands


def _keeps_speed_limit(observation: Observation) -> Reason:
    commands = _commands_of_turns(observation)
    observation.greatest_speed(commands, ANGULAR)
    rates = commands[:, ANGULAR]
    fast = [f'{rate:.1f} rad/s to the {way}' for rate, way in (
        (rates.max(), 'left'), (-rates.min(), 'right')) if rate > MAX_ANG_Z + ROUNDING]
    return '' if not fast else f"while turning it commanded up to {' and '.join(fast)}"


def _on_the_spot(observation: Observation) -> Reason:
    fastest = observation.greatest_speed(_commands_of_turns(observation), LINEAR)
    return '' if fastest < ROUNDING else \
        f'it commanded up to {fastest:.2f} m/s forward while turning'


def _answers_nonsense(observation: Observation) -> Reason:
    scene = observation.scene(NONSENSE)
    if len(scene.moving):
        return f'the robot moved after "{TYPED_NONSENSE}" was typed'
    if scene.lines > LEGIBLE:
        return (f'an answer to "{TYPED_NONSENSE}" could not be read: {scene.lines} lines were '
                f'printed in {scene.end - scene.begin:.1f} s')
    words = set(re.findall(r'[a-z]+', scene.printed.lower()))
    if not (words & {LEFT_KEY, 'left'} and words & {RIGHT_KEY, 'right'}):
        return f'the answer to "{TYPED_NONSENSE}" did not name both valid inputs, l and r'
    return ''


def _require_drive_by_mouse(observation):
    if not len(observation.scene(MOUSE_UP).moving):
        raise NotObserved('the mouse did not move the robot at all')


def _has_dead_zone(observation: Observation) -> Reason:
    _require_drive_by_mouse(observation)
    return not_stopped(observation.scene(NEAR_MIDDLE),
                       f'the mouse came to {MOUSE_PLACES[NEAR_MIDDLE]}')


def _stops_when_deactivated(observation: Observation) -> Reason:
    if len(observation.scene(NOT_ACTIVE).moving):
        return 'the mouse moved the robot before it was activated'
    _require_drive_by_mouse(observation)
    return not_stopped(observation.scene(DEACTIVATED), 'the mouse was deactivated')


def _drives_after_turn(observation: Observation) -> Reason:
    up, scene = sign_of_up(observation), observation.scene(AFTER_TURN)
    return '' if any_full_speed(scene.commands, up) else \
        'after a turn the mouse did not move the robot any more'


def _drives_in_turn(observation: Observation) -> Reason:
    up, scene = sign_of_up(observation), observation.scene(IN_TURN)
    if not scene.facts[WAS_MOVING]:
        return 'there was no turn in the middle of which the mouse could be moved'
    return '' if any_full_speed(scene.commands, up) else \
        'the mouse, moved in the middle of a turn, had not driven the robot as before {:.0f} s ' \
        'later'.format(scene.end - scene.begin)


def sign_of_up(observation: Observation) -> float:
    """Returns the right sign of the speed for a mouse at the upper edge. It is 1.0 if the direction
    of y is known from the submission's own mouse client, else that of the first such speed."""
    speeds = [speed for name in (MOUSE_UP, AFTER_TURN, IN_TURN) if observation.has(name)
              for speed in observation.scene(name, may_die=True).moving[:, LINEAR] if speed]
    return -1.0 if not observation.mouse_up and speeds and speeds[0] < 0.0 else 1.0


def any_full_speed(commands: Iterable[Sequence[float]], *signs: float) -> bool:
    """Is any of these commands, rows of time, linear, angular, the speed for a mouse at the upper
    edge, with one of these signs?"""
    return any(sign * command[LINEAR] > AT_EDGE[0] for command in commands for sign in signs)


def _mouse_drives(observation: Observation) -> Reason:
    up = sign_of_up(observation)
    return (steers(observation, MOUSE_UP, linear=times(up, AT_EDGE), of_moving=True)
            or steers(observation, MOUSE_LEFT, angular=AT_EDGE, of_moving=True)
            or steers(observation, HALF_WAY, times(-up, AT_HALF), times(-1.0, AT_HALF),
                      of_moving=True))


def remarks_on_turns(observation: Observation, parts: Sequence[str] = ()) -> List[str]:
    """Returns sentences on mistakes that cost no points."""
    printed = [observation.scene(name, may_die=True).printed.splitlines()[1:]
               for name in (LEFT_KEY, NONSENSE) if observation.has(name)]
    remarks = []
    if len(printed) > 1 and len(printed[1]) == 1 and printed[0][-1:] == printed[1]:
        remarks.append('After "{}" it printed its prompt alone, and no error. See {}.'.format(
            TYPED_NONSENSE, TO_RIGHT))
    if sign_of_up(observation) < 0.0:
        remarks.append(NO_CLIENT)
    if observation.mouse_up < 0:
        remarks.append(COUNTS_DOWN)
    return remarks


CRITERIA = [
    Criterion('starts', TURNS, 'runs and listens to imu', START, starts, limits=IN_TIME),
    Criterion('left', TURNS, f'l turns {TURN_DEG:g} degrees left', LAW,
              partial(turned, name=LEFT_KEY), limits=TURN_LIMITS),
    Criterion('right', TURNS, f'r turns {TURN_DEG:g} degrees right', TO_RIGHT,
              partial(turned, name=RIGHT_KEY), limits=ON_A_CARPET),
    Criterion('short_way', TURNS, 'turns the same across 180 and 0 degrees', LAW,
              lambda observation: _turned_each(observation, ACROSS), limits=ON_A_CARPET),
    Criterion('clamped', TURNS, f'turns no faster than {MAX_ANG_Z:g} rad/s', LAW,
              _keeps_speed_limit, limits=f'and {ROUNDING:g} for rounding'),
    Criterion('on_the_spot', TURNS, 'does not drive forward while it turns', LAW,
              _on_the_spot, limits=f'less than {ROUNDING:g} m/s'),
    Criterion('answers_nonsense', TURNS, 'answers any other input by an error that names the valid '
              'ones', TO_RIGHT, _answers_nonsense, limits='within {:g} s, in at most {} lines; '
              'the robot rests'.format(ANSWER, LEGIBLE)),
    Criterion('mouse_drives', MOUSE, 'mouse up drives forward, left turns left, {:g} at the '
              'edge'.format(MOUSE_FULL), AT_MOUSE, _mouse_drives, limits=DRIVES),
    Criterion('mouse_dead_zone', MOUSE, 'a mouse within {:g} of the middle moves nothing'.format(
        MOUSE_DEAD_ZONE), AT_MOUSE, _has_dead_zone,
              limits='zero velocity at ({:g}, {:g}) within {:g} s'.format(
                  *MOUSE_PLACES[NEAR_MIDDLE], AT_ONCE)),
    Criterion('mouse_off', MOUSE, 'the robot stops at once when the mouse is deactivated',
              AT_MOUSE, _stops_when_deactivated, limits='zero velocity ' + STOPS_AT_ONCE),
    Criterion('turn_beside_mouse', BOTH, 'turns also while the mouse is active in the middle',
              AT_MOUSE, partial(turned, name=TURN_BESIDE, seconds=BESIDE_TIME),
              limits=f'as left, over within {BESIDE_TIME:g} s'),
    Criterion('mouse_after_turn', BOTH, 'the mouse drives after a turn', AT_MOUSE,
              _drives_after_turn,
              limits=f'more than {AT_EDGE[0]:.2f} m/s within {MOUSE_HELD:g} s'),
    Criterion('mouse_in_turn', BOTH, 'a mouse moved during a turn drives then or after it',
              AT_MOUSE, _drives_in_turn, limits=within(AT_LAST)),
    Criterion('stops_robot', SHUTDOWN, 'at Ctrl+C in a turn sends zero velocity', AT_CTRL_C,
              stops_robot, limits=STOPS_AT_ONCE),
    Criterion('says_goodbye', SHUTDOWN, f'at Ctrl+C says "{CONTROLLER_GOODBYE}"', AT_CTRL_C,
              partial(prints, words=CONTROLLER_GOODBYE)),
    ends_cleanly(SHUTDOWN, AT_CTRL_C),
    Criterion('within_1_deg', TURNS, f'all turns are within {EXACT:g} degree', IMU_EXTRAS,
              lambda observation: _turned_each(observation, TURN_STIMULI, EXACT), extra=True),
    stops_when_lost('lost_imu', 'stops a turn', 'the IMU', IMU_SILENT, IMU_EXTRAS),
    stops_when_lost('lost_mouse', 'stops the robot', 'the mouse', MOUSE_SILENT, IMU_EXTRAS),
]
