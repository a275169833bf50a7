"""The criteria of the IMU lab, in which the keyboard turns the robot, and the mouse drives it."""
import re
from functools import partial
from typing import Iterable, List, Sequence

import numpy as np

from tb3_labs.handout import (
    CONTROLLER_GOODBYE, HDG_TOL, LEFT_KEY, MAX_ANG_Z, MOUSE_DEAD_ZONE, MOUSE_FULL, RIGHT_KEY,
    TURN_DEG)
from tb3_labs.marking.labs.criteria import (
    ANGULAR, IMU_EXTRAS, LINEAR, NO_ZERO_VELOCITY, ROUNDING, START_LIMITS, STOP_LIMITS,
    ZERO_TOLERANCE, Criterion, Reason, clean_exit_criterion, ends_in_motion, lost_device_criterion,
    scaled, why_not_printed, why_not_started, why_not_steered, why_not_stopped,
    why_not_stopped_at_ctrl_c, within)
from tb3_labs.marking.labs.stimuli import (
    ANSWER_TIME, BESIDE_MOUSE_TIME, CARPET_SLIP, IMU_SILENT, MAX_TURN_TIME, MOUSE, MOUSE_AFTER_TURN,
    MOUSE_AND_TURNS, MOUSE_DEACTIVATED, MOUSE_HALF_WAY, MOUSE_HOLD_TIME, MOUSE_IN_TURN, MOUSE_LEFT,
    MOUSE_NEAR_MIDDLE, MOUSE_NOT_ACTIVE, MOUSE_POSITIONS, MOUSE_REACTION_TIME, MOUSE_SILENT,
    MOUSE_UP, NONSENSE, SHUTDOWN, TURNS, TURN_BESIDE_MOUSE, TURN_REACTION_TIME, TURN_STIMULI,
    TYPED_NONSENSE)
from tb3_labs.marking.trial.observation import MOVED, RESTED, WAS_MOVING, NotObserved, Observation
from tb3_labs.marking.trial.remarks import MAX_IDLE_TURN_DEG, why_idle
from tb3_labs.watch.lab_links import TURN_SECTION

MOUSE_STEP = TURN_SECTION.at_step(2)
START_STEP = TURN_SECTION.at_step(4)
LAW_STEP = TURN_SECTION.at_step(5)
RIGHT_TURN_STEP = TURN_SECTION.at_step(6)
CTRL_C_STEP = TURN_SECTION.at_step(7)
TURNS_ACROSS_JUMP = [name for name, turn in TURN_STIMULI.items() if turn.crossing]
COAST_DEG = 1.0             # after a stop command
MAX_LEGIBLE_LINES = 1000    # of an answer
MAX_EXACT_ERROR_DEG = 1.0   # in the criterion `within_1_deg`
NO_MOUSE_CLIENT = 'A mouse at the upper edge, y = 1, drives backward. That is right if your ' \
    'mouse client counts y down; none was found.'
Y_COUNTS_DOWN = 'Your mouse client counts y down, so the check does: up is y = -1.'
#: The speeds [m/s or rad/s] for a mouse at the edge of the screen, and at 0.6 of the way to the
#: edge. The mouse lab does not say how the speed grows outside the dead zone.
MIN_EDGE_SPEED, MAX_EDGE_SPEED = MOUSE_FULL - ZERO_TOLERANCE, MOUSE_FULL + ZERO_TOLERANCE
MIN_HALF_WAY_SPEED, MAX_HALF_WAY_SPEED = 0.2 * MOUSE_FULL, 0.8 * MOUSE_FULL
EDGE_BOUNDS = (MIN_EDGE_SPEED, MAX_EDGE_SPEED)
HALF_WAY_BOUNDS = (MIN_HALF_WAY_SPEED, MAX_HALF_WAY_SPEED)
MOUSE_LIMITS = f'{within(MOUSE_HOLD_TIME)}: {MIN_EDGE_SPEED:.2f} to {MAX_EDGE_SPEED:.2f} at the ' \
    f'edge, the other speed at most {ZERO_TOLERANCE:g}; both {MIN_HALF_WAY_SPEED:.2f} to ' \
    f'{MAX_HALF_WAY_SPEED:.2f} at {MOUSE_POSITIONS[MOUSE_HALF_WAY]}'
TURN_LIMITS = f'within {HDG_TOL:g} degrees, and {COAST_DEG:g} for stopping; begun ' \
    f'{within(TURN_REACTION_TIME)}, over {within(MAX_TURN_TIME)}, by a zero velocity'
CARPET_LIMITS = f'as left, also if the wheels slip by {CARPET_SLIP:.0%}'


def why_not_turned(observation: Observation, name: str, tolerance: float = HDG_TOL + COAST_DEG,
                   seconds: float = MAX_TURN_TIME) -> Reason:
    """Judges whether the robot made the turn `name` within `tolerance` [deg] and `seconds` [s]."""
    scene = observation.scene(name)
    turn = TURN_STIMULI.get(name, TURN_STIMULI[LEFT_KEY])
    after = f'after {turn.typed}'
    if turn.crossing:
        after += f' ({turn.crossing})'
    observed_deg = scene.turned_deg
    turned_text = f'it turned {_degrees(observed_deg)}'
    if not scene.facts[MOVED]:
        is_idle = abs(observed_deg) < MAX_IDLE_TURN_DEG
        effect = 'the robot did not turn' if is_idle else turned_text
        return f'{after} {effect}: {why_idle(scene)}'
    if not scene.facts[RESTED]:
        return f'{after} {turned_text}, and was still moving after {seconds:g} s'
    error = abs(observed_deg - turn.requested_deg)
    if error <= tolerance:
        is_stopped = not ends_in_motion(scene.commands)
        return '' if is_stopped else NO_ZERO_VELOCITY.format('its turn ' + after)
    on_carpet = ', where the wheels slip,' if turn.slip else ''
    reason = f'{after}{on_carpet} {turned_text}, then stopped'
    if observed_deg * turn.requested_deg <= 0.0:
        return reason
    side = 'short of' if abs(observed_deg) < abs(turn.requested_deg) else 'beyond'
    return (f'{reason}: {error:.1f} degrees {side} the goal, where '
            f'{min(tolerance, HDG_TOL):g} are allowed')


def _degrees(observed_deg):
    number = f'{abs(observed_deg):.1f}'
    if float(number) == 0.0:
        return number + ' degrees'
    side = 'left' if observed_deg > 0.0 else 'right'
    return f'{number} degrees to the {side}'


def _why_turns_failed(observation: Observation, names: Iterable[str],
                      tolerance: float = HDG_TOL + COAST_DEG) -> Reason:
    reasons = (why_not_turned(observation, name, tolerance) for name in names)
    return next(filter(None, reasons), '')


def _commands_of_turns(observation):
    """Returns the commands of all turns. Raises ``NotObserved`` if no turn moved the robot."""
    commands = np.vstack([turn.moving_commands for turn in observation.scenes(list(TURN_STIMULI))])
    if not len(commands):
        raise NotObserved('the robot was never turned')
    return commands


def _why_turned_too_fast(observation: Observation) -> Reason:
    commands = _commands_of_turns(observation)
    observation.set_moment_of_fastest(commands, ANGULAR)
    rates = commands[:, ANGULAR]
    greatest = (rates.max(), 'left'), (-rates.min(), 'right')
    too_fast = [f'{rate:.1f} rad/s to the {side}' for rate, side in greatest
                if rate > MAX_ANG_Z + ROUNDING]
    if not too_fast:
        return ''
    return f"while turning it commanded up to {' and '.join(too_fast)}"


def _why_not_on_the_spot(observation: Observation) -> Reason:
    commands = _commands_of_turns(observation)
    observation.set_moment_of_fastest(commands, LINEAR)
    fastest = np.abs(commands[:, LINEAR]).max()
    return '' if fastest < ROUNDING else (
        f'it commanded up to {fastest:.2f} m/s forward while turning')


def _why_not_answered(observation: Observation) -> Reason:
    scene = observation.scene(NONSENSE)
    if len(scene.moving_commands):
        return f'the robot moved after "{TYPED_NONSENSE}" was typed'
    if scene.line_count > MAX_LEGIBLE_LINES:
        return (f'an answer to "{TYPED_NONSENSE}" could not be read: {scene.line_count} lines were '
                f'printed in {scene.end - scene.begin:.1f} s')
    words = set(re.findall(r'[a-z]+', scene.printed.lower()))
    names_left = words & {LEFT_KEY, 'left'}
    names_right = words & {RIGHT_KEY, 'right'}
    if names_left and names_right:
        return ''
    return f'the answer to "{TYPED_NONSENSE}" did not name both valid inputs, l and r'


def _require_drive_by_mouse(observation):
    if not len(observation.scene(MOUSE_UP).moving_commands):
        raise NotObserved('the mouse did not move the robot at all')


def _why_no_dead_zone(observation: Observation) -> Reason:
    _require_drive_by_mouse(observation)
    return why_not_stopped(observation.scene(MOUSE_NEAR_MIDDLE),
                           f'the mouse came to {MOUSE_POSITIONS[MOUSE_NEAR_MIDDLE]}')


def _why_not_deactivated(observation: Observation) -> Reason:
    if len(observation.scene(MOUSE_NOT_ACTIVE).moving_commands):
        return 'the mouse moved the robot before it was activated'
    _require_drive_by_mouse(observation)
    return why_not_stopped(observation.scene(MOUSE_DEACTIVATED), 'the mouse was deactivated')


def _why_not_driven_after_turn(observation: Observation) -> Reason:
    forward_sign = expected_sign_at_top(observation)
    if any_full_speed(observation.scene(MOUSE_AFTER_TURN).commands, forward_sign):
        return ''
    return 'after a turn the mouse did not move the robot any more'


def _why_not_driven_in_turn(observation: Observation) -> Reason:
    forward_sign = expected_sign_at_top(observation)
    scene = observation.scene(MOUSE_IN_TURN)
    if not scene.facts[WAS_MOVING]:
        return 'there was no turn in the middle of which the mouse could be moved'
    if any_full_speed(scene.commands, forward_sign):
        return ''
    return ('the mouse, moved in the middle of a turn, had not driven the robot as before '
            f'{scene.end - scene.begin:.0f} s later')


def expected_sign_at_top(observation: Observation) -> float:
    """Returns the sign of the speed that a correct node commands for a mouse at the upper edge.

    The marker has applied the sign of the submission's mouse client to y, so a correct node drives
    forward: 1.0. Without a known mouse client, the node's first speed at this edge has the sign.
    """
    if observation.mouse_y_sign:
        return 1.0
    for name in filter(observation.has, (MOUSE_UP, MOUSE_AFTER_TURN, MOUSE_IN_TURN)):
        speeds = observation.scene(name, may_die=True).moving_commands[:, LINEAR]
        if speeds.any():
            first_speed = speeds[speeds != 0.0][0]
            return 1.0 if first_speed > 0.0 else -1.0
    return 1.0


def any_full_speed(commands: Iterable[Sequence[float]], *signs: float) -> bool:
    """Does a command drive as fast as a mouse at the upper edge requires? The speed must have one
    of the `signs`. A command is (time, linear, angular)."""
    speeds = [sign * command[LINEAR] for command in commands for sign in signs]
    return any(speed > MIN_EDGE_SPEED for speed in speeds)


def _why_not_driven_by_mouse(observation: Observation) -> Reason:
    forward_sign = expected_sign_at_top(observation)
    return (why_not_steered(observation, MOUSE_UP, linear=scaled(EDGE_BOUNDS, forward_sign),
                            skip_zeros=True)
            or why_not_steered(observation, MOUSE_LEFT, angular=EDGE_BOUNDS, skip_zeros=True)
            or why_not_steered(observation, MOUSE_HALF_WAY, skip_zeros=True,
                               linear=scaled(HALF_WAY_BOUNDS, -forward_sign),
                               angular=scaled(HALF_WAY_BOUNDS, -1.0)))


def _printed_only_prompt(observation):
    if not (observation.has(LEFT_KEY) and observation.has(NONSENSE)):
        return False
    after_turn = _lines_after_letter(observation, LEFT_KEY)
    after_nonsense = _lines_after_letter(observation, NONSENSE)
    return len(after_nonsense) == 1 and after_turn[-1:] == after_nonsense


def _lines_after_letter(observation, name):
    return observation.scene(name, may_die=True).printed.splitlines()[1:]


def remarks_on_turns(observation: Observation) -> List[str]:
    """Returns sentences on mistakes that cost no points."""
    remarks = []
    if _printed_only_prompt(observation):
        remarks.append(f'After "{TYPED_NONSENSE}" it printed its prompt alone, and no error. See '
                       f'{RIGHT_TURN_STEP}.')
    if expected_sign_at_top(observation) < 0.0:
        remarks.append(NO_MOUSE_CLIENT)
    if observation.mouse_y_sign < 0:
        remarks.append(Y_COUNTS_DOWN)
    return remarks


CRITERIA = [
    Criterion('starts', TURNS, 'runs and listens to imu', START_STEP, why_not_started,
              limits=START_LIMITS),
    Criterion('left', TURNS, f'l turns {TURN_DEG:g} degrees left', LAW_STEP,
              partial(why_not_turned, name=LEFT_KEY), limits=TURN_LIMITS),
    Criterion('right', TURNS, f'r turns {TURN_DEG:g} degrees right', RIGHT_TURN_STEP,
              partial(why_not_turned, name=RIGHT_KEY), limits=CARPET_LIMITS),
    Criterion('short_way', TURNS, 'turns the same across 180 and 0 degrees', LAW_STEP,
              partial(_why_turns_failed, names=TURNS_ACROSS_JUMP), limits=CARPET_LIMITS),
    Criterion('clamped', TURNS, f'turns no faster than {MAX_ANG_Z:g} rad/s', LAW_STEP,
              _why_turned_too_fast, limits=f'and {ROUNDING:g} for rounding'),
    Criterion('on_the_spot', TURNS, 'does not drive forward while it turns', LAW_STEP,
              _why_not_on_the_spot, limits=f'less than {ROUNDING:g} m/s'),
    Criterion('answers_nonsense', TURNS, 'answers any other input by an error that names the valid '
              'ones', RIGHT_TURN_STEP, _why_not_answered, limits=f'{within(ANSWER_TIME)}, in at '
              f'most {MAX_LEGIBLE_LINES} lines; the robot rests'),
    Criterion('mouse_drives', MOUSE, f'mouse up drives forward, left turns left, {MOUSE_FULL:g} at '
              'the edge', MOUSE_STEP, _why_not_driven_by_mouse, limits=MOUSE_LIMITS),
    Criterion('mouse_dead_zone', MOUSE, f'a mouse within {MOUSE_DEAD_ZONE:g} of the middle moves '
              'nothing', MOUSE_STEP, _why_no_dead_zone,
              limits=f'zero velocity at {MOUSE_POSITIONS[MOUSE_NEAR_MIDDLE]} {STOP_LIMITS}'),
    Criterion('mouse_off', MOUSE, 'the robot stops at once when the mouse is deactivated',
              MOUSE_STEP, _why_not_deactivated, limits='zero velocity ' + STOP_LIMITS),
    Criterion('turn_beside_mouse', MOUSE_AND_TURNS,
              'turns also while the mouse is active in the middle', MOUSE_STEP,
              partial(why_not_turned, name=TURN_BESIDE_MOUSE, seconds=BESIDE_MOUSE_TIME),
              limits='as left, over ' + within(BESIDE_MOUSE_TIME)),
    Criterion('mouse_after_turn', MOUSE_AND_TURNS, 'the mouse drives after a turn', MOUSE_STEP,
              _why_not_driven_after_turn,
              limits=f'more than {MIN_EDGE_SPEED:.2f} m/s {within(MOUSE_HOLD_TIME)}'),
    Criterion('mouse_in_turn', MOUSE_AND_TURNS,
              'a mouse moved during a turn drives then or after it', MOUSE_STEP,
              _why_not_driven_in_turn, limits=within(MOUSE_REACTION_TIME)),
    Criterion('stops_robot', SHUTDOWN, 'at Ctrl+C in a turn sends zero velocity', CTRL_C_STEP,
              why_not_stopped_at_ctrl_c, limits=STOP_LIMITS),
    Criterion('says_goodbye', SHUTDOWN, f'at Ctrl+C says "{CONTROLLER_GOODBYE}"', CTRL_C_STEP,
              partial(why_not_printed, text=CONTROLLER_GOODBYE)),
    clean_exit_criterion(SHUTDOWN, CTRL_C_STEP),
    Criterion('within_1_deg', TURNS, f'all turns are within {MAX_EXACT_ERROR_DEG:g} degree',
              IMU_EXTRAS, partial(_why_turns_failed, names=TURN_STIMULI,
                                  tolerance=MAX_EXACT_ERROR_DEG), extra=True),
    lost_device_criterion('lost_imu', 'stops a turn', 'the IMU', IMU_SILENT, IMU_EXTRAS),
    lost_device_criterion('lost_mouse', 'stops the robot', 'the mouse', MOUSE_SILENT, IMU_EXTRAS),
]
