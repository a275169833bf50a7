"""The criteria of the IMU lab, in which the keyboard turns the robot, and the mouse drives it."""
import math
import re
from functools import partial
from typing import Iterable, List

import numpy as np

from tb3_labs.handout import (
    CONTROLLER_GOODBYE, HDG_TOL, LEFT_KEY, MAX_ANG_Z, MOUSE_DEAD_ZONE, MOUSE_FULL, RIGHT_KEY,
    TURN_DEG)
from tb3_labs.marking.labs import stimuli
from tb3_labs.marking.labs.criteria import (
    IMU_EXTRAS, NO_ZERO_VELOCITY, ROUNDING_TOLERANCE, START_LIMITS, STOP_LIMITS, ZERO_TOLERANCE,
    Criterion, Reason, bounds_text, clean_exit_criterion, ends_in_motion, judge_line_at_ctrl_c,
    judge_start, judge_steering, judge_stop, judge_stop_at_ctrl_c, lost_device_criterion, scaled,
    within)
from tb3_labs.marking.trial.observation import (
    ANGULAR, LINEAR, MOVED, RESTED, WAS_MOVING, NotObserved, Observation)
from tb3_labs.marking.trial.remarks import MAX_IDLE_TURN_DEG, why_idle
from tb3_labs.watch.lab_mistakes import TURN_SECTION

MOUSE_STEP = TURN_SECTION.at_step(2)
LAW_STEP = TURN_SECTION.at_step(5)
RIGHT_TURN_STEP = TURN_SECTION.at_step(6)
CTRL_C_STEP = TURN_SECTION.at_step(7)
POSITION_NEAR_MIDDLE = stimuli.MOUSE_POSITIONS[stimuli.MOUSE_NEAR_MIDDLE]
STIMULI_ACROSS_JUMP = [name for name, turn in stimuli.TURN_STIMULI.items() if turn.crossing]
COAST_DEG = 1.0             # After a stop command, the robot turns further by at most this angle.
MAX_LEGIBLE_LINES = 1000    # A student cannot read an answer of more lines.
MAX_EXACT_ERROR_DEG = 1.0   # in the criterion `within_1_deg`
NO_MOUSE_CLIENT = (
    'A mouse at the upper edge, y = 1, drives backward. That is right if your mouse client counts '
    'y down; none was found.')
Y_COUNTS_DOWN = 'Your mouse client counts y down, so the check does: up is y = -1.'
#: The bounds of the speed [m/s or rad/s] for a mouse at the edge, and for a mouse at 0.6 of the way
#: there. The second bounds are wide, because the mouse lab does not say how the speed grows.
MIN_EDGE_SPEED = MOUSE_FULL - ZERO_TOLERANCE
EDGE_BOUNDS = (MIN_EDGE_SPEED, MOUSE_FULL + ZERO_TOLERANCE)
HALF_WAY_BOUNDS = (0.2 * MOUSE_FULL, 0.8 * MOUSE_FULL)
MOUSE_LIMITS = (
    f'{within(stimuli.MOUSE_HOLD_TIME)}: {bounds_text(EDGE_BOUNDS)} at the edge, the other speed '
    f'at most {ZERO_TOLERANCE:g}; both {bounds_text(HALF_WAY_BOUNDS)} at '
    f'{stimuli.MOUSE_POSITIONS[stimuli.MOUSE_HALF_WAY]}')
TURN_LIMITS = (
    f'within {HDG_TOL:g} degrees, and {COAST_DEG:g} for stopping; begun '
    f'{within(stimuli.TURN_REACTION_TIME)}, over {within(stimuli.MAX_TURN_TIME)}, by a zero '
    'velocity')
CARPET_LIMITS = f'as left, also if the wheels slip by {stimuli.CARPET_SLIP:.0%}'


def judge_turn(observation: Observation, name: str, tolerance: float = HDG_TOL + COAST_DEG,
               seconds: float = stimuli.MAX_TURN_TIME) -> Reason:
    """Judges whether the robot made the turn `name` within `tolerance` [deg] and `seconds` [s]."""
    scene = observation.enter_scene(name)
    letter = LEFT_KEY if name == stimuli.TURN_BESIDE_MOUSE else name
    turn = stimuli.TURN_STIMULI[letter]
    occasion = f'after {turn.typed}'
    if turn.crossing:
        occasion += f' ({turn.crossing})'
    turned_text = f'it turned {_turn_text(scene.turned_deg)}'
    if not scene.facts[MOVED]:
        is_idle = abs(scene.turned_deg) < MAX_IDLE_TURN_DEG
        effect = 'the robot did not turn' if is_idle else turned_text
        return f'{occasion} {effect}: {why_idle(scene)}'
    if not scene.facts[RESTED]:
        return f'{occasion} {turned_text}, and was still moving after {seconds:g} s'
    if abs(scene.turned_deg - turn.requested_deg) > tolerance:
        if turn.slip:
            occasion += ', where the wheels slip,'
        clause_on_error = _clause_on_error(scene.turned_deg, turn.requested_deg, tolerance)
        return f'{occasion} {turned_text}, then stopped{clause_on_error}'
    if ends_in_motion(scene.commands):
        return NO_ZERO_VELOCITY.format('its turn ' + occasion)
    return ''


def _clause_on_error(turned_deg, requested_deg, tolerance):
    """Returns a clause on the error of a turn; '' if the robot turned in the wrong direction."""
    if turned_deg * requested_deg <= 0.0:
        return ''
    error_deg = abs(turned_deg - requested_deg)
    side = 'short of' if abs(turned_deg) < abs(requested_deg) else 'beyond'
    allowed_deg = min(tolerance, HDG_TOL)
    return f': {error_deg:.1f} degrees {side} the goal, where {allowed_deg:g} are allowed'


def _turn_text(turned_deg):
    text = f'{abs(turned_deg):.1f} degrees'
    if round(turned_deg, 1) == 0.0:
        return text
    return text + (' to the left' if turned_deg > 0.0 else ' to the right')


def _judge_turns(observation: Observation, names: Iterable[str],
                 tolerance: float = HDG_TOL + COAST_DEG) -> Reason:
    reasons = (judge_turn(observation, name, tolerance) for name in names)
    return next(filter(None, reasons), '')


def _commands_of_turns(observation):
    """Returns the commands of all turns. Raises ``NotObserved`` if no turn moved the robot."""
    turns = observation.enter_scenes(list(stimuli.TURN_STIMULI))
    commands = np.vstack([turn.moving_commands for turn in turns])
    if not len(commands):
        raise NotObserved('the robot was never turned')
    return commands


def _judge_turn_speed(observation: Observation) -> Reason:
    commands = _commands_of_turns(observation)
    limit = MAX_ANG_Z + ROUNDING_TOLERANCE
    if observation.fastest_speed(commands, ANGULAR) <= limit:
        return ''
    angular = commands[:, ANGULAR]
    speeds = {'left': angular.max(), 'right': -angular.min()}
    excesses = [f'{speed:.1f} rad/s to the {side}'
                for side, speed in speeds.items() if speed > limit]
    return f"while turning it commanded up to {' and '.join(excesses)}"


def _judge_turn_on_the_spot(observation: Observation) -> Reason:
    fastest = observation.fastest_speed(_commands_of_turns(observation), LINEAR)
    if fastest < ROUNDING_TOLERANCE:
        return ''
    return f'it commanded up to {fastest:.2f} m/s forward while turning'


def _judge_answer_to_nonsense(observation: Observation) -> Reason:
    scene = observation.enter_scene(stimuli.NONSENSE)
    if len(scene.moving_commands):
        return f'the robot moved after "{stimuli.TYPED_NONSENSE}" was typed'
    if scene.line_count > MAX_LEGIBLE_LINES:
        return (f'an answer to "{stimuli.TYPED_NONSENSE}" could not be read: {scene.line_count} '
                f'lines were printed in {scene.end - scene.begin:.1f} s')
    words = set(re.findall(r'[a-z]+', scene.printed.lower()))
    if words & {LEFT_KEY, 'left'} and words & {RIGHT_KEY, 'right'}:
        return ''
    return f'the answer to "{stimuli.TYPED_NONSENSE}" did not name both valid inputs, l and r'


def _require_drive_by_mouse(observation):
    if not len(observation.enter_scene(stimuli.MOUSE_UP).moving_commands):
        raise NotObserved('the mouse did not move the robot at all')


def _judge_dead_zone(observation: Observation) -> Reason:
    _require_drive_by_mouse(observation)
    return judge_stop(observation, stimuli.MOUSE_NEAR_MIDDLE,
                      f'the mouse came to {POSITION_NEAR_MIDDLE}')


def _judge_inactive_mouse(observation: Observation) -> Reason:
    if len(observation.enter_scene(stimuli.MOUSE_NOT_ACTIVE).moving_commands):
        return 'the mouse moved the robot before it was activated'
    _require_drive_by_mouse(observation)
    return judge_stop(observation, stimuli.MOUSE_DEACTIVATED, 'the mouse was deactivated')


def _judge_mouse_after_turn(observation: Observation) -> Reason:
    if _has_driven_forward(observation, stimuli.MOUSE_AFTER_TURN):
        return ''
    if len(observation.enter_scene(stimuli.MOUSE_AFTER_TURN).moving_commands):
        return ('after a turn the robot was not driven forward by '
                f'{MIN_EDGE_SPEED:g} m/s with the mouse at the upper edge')
    return 'after a turn the mouse did not move the robot any more'


def _judge_mouse_in_turn(observation: Observation) -> Reason:
    scene = observation.enter_scene(stimuli.MOUSE_IN_TURN)
    if not scene.facts[WAS_MOVING]:
        return 'there was no turn in the middle of which the mouse could be moved'
    if _has_driven_forward(observation, stimuli.MOUSE_IN_TURN):
        return ''
    return ('the mouse, moved in the middle of a turn, had not driven the robot as before '
            f'{scene.end - scene.begin:.0f} s later')


def _has_driven_forward(observation, name):
    """Returns True if the node drove the robot as fast as a mouse at the upper edge requires."""
    forward_sign = forward_sign_of(observation)
    forward_speeds = forward_sign * observation.enter_scene(name).commands[:, LINEAR]
    return (forward_speeds > MIN_EDGE_SPEED).any()


def forward_sign_of(observation: Observation) -> float:
    """Returns the sign of the speed that a correct node commands for a mouse at the upper edge.

    The marker sends y with the sign of the submission's mouse client, so a correct node drives
    forward. If this sign is unknown, the node may drive in either direction. Then the result is the
    sign of the node's first speed at the upper edge.
    """
    if observation.mouse_y_sign:
        return 1.0
    names = (stimuli.MOUSE_UP, stimuli.MOUSE_AFTER_TURN, stimuli.MOUSE_IN_TURN)
    for name in filter(observation.has_stimulus, names):
        for speed in observation.enter_scene(name, may_die=True).commands[:, LINEAR]:
            if speed != 0.0:
                return math.copysign(1.0, speed)
    return 1.0


def _judge_drive_by_mouse(observation: Observation) -> Reason:
    forward_sign = forward_sign_of(observation)
    judge = partial(judge_steering, observation, skip_zeros=True)
    return (judge(stimuli.MOUSE_UP, linear=scaled(EDGE_BOUNDS, forward_sign))
            or judge(stimuli.MOUSE_LEFT, angular=EDGE_BOUNDS)
            or judge(stimuli.MOUSE_HALF_WAY, linear=scaled(HALF_WAY_BOUNDS, -forward_sign),
                     angular=scaled(HALF_WAY_BOUNDS, -1.0)))


def _has_printed_only_prompt(observation):
    names = (LEFT_KEY, stimuli.NONSENSE)
    if not all(map(observation.has_stimulus, names)):
        return False
    # the first line of the output shows the typed letter
    lines_after_turn, lines_after_nonsense = (
        observation.enter_scene(name, may_die=True).printed.splitlines()[1:] for name in names)
    if not lines_after_turn or len(lines_after_nonsense) != 1:
        return False
    return lines_after_turn[-1] == lines_after_nonsense[0]


def remarks_on_turns(observation: Observation) -> List[str]:
    """Returns sentences on mistakes that cost no points."""
    remarks = []
    if _has_printed_only_prompt(observation):
        remarks.append(f'After "{stimuli.TYPED_NONSENSE}" it printed its prompt alone, and no '
                       f'error. See {RIGHT_TURN_STEP}.')
    if forward_sign_of(observation) < 0.0:
        remarks.append(NO_MOUSE_CLIENT)
    if observation.mouse_y_sign < 0:
        remarks.append(Y_COUNTS_DOWN)
    return remarks


CRITERIA = [
    Criterion('starts', stimuli.TURNS, 'runs and listens to imu', TURN_SECTION.at_step(4),
              judge_start, limits=START_LIMITS),
    Criterion('left', stimuli.TURNS, f'l turns {TURN_DEG:g} degrees left', LAW_STEP,
              partial(judge_turn, name=LEFT_KEY), limits=TURN_LIMITS),
    Criterion('right', stimuli.TURNS, f'r turns {TURN_DEG:g} degrees right', RIGHT_TURN_STEP,
              partial(judge_turn, name=RIGHT_KEY), limits=CARPET_LIMITS),
    Criterion('short_way', stimuli.TURNS, 'turns the same across 180 and 0 degrees', LAW_STEP,
              partial(_judge_turns, names=STIMULI_ACROSS_JUMP), limits=CARPET_LIMITS),
    Criterion('clamped', stimuli.TURNS, f'turns no faster than {MAX_ANG_Z:g} rad/s', LAW_STEP,
              _judge_turn_speed, limits=f'and {ROUNDING_TOLERANCE:g} for rounding'),
    Criterion('on_the_spot', stimuli.TURNS, 'does not drive forward while it turns', LAW_STEP,
              _judge_turn_on_the_spot, limits=f'less than {ROUNDING_TOLERANCE:g} m/s'),
    Criterion('answers_nonsense', stimuli.TURNS,
              'answers any other input by an error that names the valid ones', RIGHT_TURN_STEP,
              _judge_answer_to_nonsense, limits=f'{within(stimuli.ANSWER_TIME)}, in at most '
              f'{MAX_LEGIBLE_LINES} lines; the robot rests'),
    Criterion('mouse_drives', stimuli.MOUSE,
              f'mouse up drives forward, left turns left, {MOUSE_FULL:g} at the edge', MOUSE_STEP,
              _judge_drive_by_mouse, limits=MOUSE_LIMITS),
    Criterion('mouse_dead_zone', stimuli.MOUSE,
              f'a mouse within {MOUSE_DEAD_ZONE:g} of the middle moves nothing', MOUSE_STEP,
              _judge_dead_zone,
              limits=f'zero velocity at {POSITION_NEAR_MIDDLE} {STOP_LIMITS}'),
    Criterion('mouse_off', stimuli.MOUSE, 'the robot stops at once when the mouse is deactivated',
              MOUSE_STEP, _judge_inactive_mouse, limits='zero velocity ' + STOP_LIMITS),
    Criterion('turn_beside_mouse', stimuli.MOUSE_AND_TURNS,
              'turns also while the mouse is active in the middle', MOUSE_STEP,
              partial(judge_turn, name=stimuli.TURN_BESIDE_MOUSE,
                      seconds=stimuli.BESIDE_MOUSE_TIME),
              limits='as left, over ' + within(stimuli.BESIDE_MOUSE_TIME)),
    Criterion('mouse_after_turn', stimuli.MOUSE_AND_TURNS, 'the mouse drives after a turn',
              MOUSE_STEP, _judge_mouse_after_turn,
              limits=f'more than {MIN_EDGE_SPEED:.2f} m/s {within(stimuli.MOUSE_HOLD_TIME)}'),
    Criterion('mouse_in_turn', stimuli.MOUSE_AND_TURNS,
              'a mouse moved during a turn drives then or after it', MOUSE_STEP,
              _judge_mouse_in_turn, limits=within(stimuli.MOUSE_REACTION_TIME)),
    Criterion('stops_robot', stimuli.SHUTDOWN, 'at Ctrl+C in a turn sends zero velocity',
              CTRL_C_STEP, judge_stop_at_ctrl_c, limits=STOP_LIMITS),
    Criterion('says_goodbye', stimuli.SHUTDOWN, f'at Ctrl+C says "{CONTROLLER_GOODBYE}"',
              CTRL_C_STEP, partial(judge_line_at_ctrl_c, text=CONTROLLER_GOODBYE)),
    clean_exit_criterion(stimuli.SHUTDOWN, CTRL_C_STEP),
    Criterion('within_1_deg', stimuli.TURNS,
              f'all turns are within {MAX_EXACT_ERROR_DEG:g} degree', IMU_EXTRAS,
              partial(_judge_turns, names=stimuli.TURN_STIMULI, tolerance=MAX_EXACT_ERROR_DEG),
              is_extra=True),
    lost_device_criterion('lost_imu', 'stops a turn', 'the IMU', stimuli.IMU_SILENT, IMU_EXTRAS),
    lost_device_criterion('lost_mouse', 'stops the robot', 'the mouse', stimuli.MOUSE_SILENT,
                          IMU_EXTRAS),
]
