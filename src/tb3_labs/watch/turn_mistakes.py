"""Checks the turns in the IMU lab. A node computes curr_yaw, goal_yaw, turning, and the command."""
import math
from typing import Iterator

import numpy as np

from tb3_labs.geometry.arrays import wrap_all
from tb3_labs.handout import HDG_TOL, MAX_ANG_Z, TURN_DEG
from tb3_labs.watch.headings import heading_candidates, heading_mistake
from tb3_labs.watch.mistake import (
    SPEED_TOLERANCE, UNUSED_FIELDS, Mistake, NodeRun, find_slow_commands, nonzero_field_text)
from tb3_labs.watch.typed_turns import (
    READING_PERIOD, TURN_OF_LETTER_DEG, UNKNOWN_LETTER, NodeTurn, letter_turns, own_heading,
    quantity_of_curr_yaw)
from tb3_labs.watch.variables import shortened_value, to_number

#: A goal_yaw may be off by this angle, since a robot may turn before the node reads the letter.
GOAL_TOLERANCE_DEG = 10.0
#: The side of a turn is judged only if the error is farther than this [deg] from 0 and from 180.
CLEAR_ERROR_DEG = 20.0
#: At a turn's end, the error may exceed the handout's tolerance by this angle [deg].
MAX_EXCESS_DEG = 4.0
MAX_FIRST_COMMAND_DELAY = 0.4       # [s] after the letter
#: Each mistake is reported only if at least this many readings or commands show it.
MIN_FALSE_READINGS = 5
MIN_ZERO_COMMANDS = 6
MIN_ZERO_PAUSES = 3
MIN_COMMANDS_AWAY = 2
MIN_FORWARD_COMMANDS = 3
MIN_PACED_COMMANDS = 3
MIN_TURNING_SPEED = 0.02            # [rad/s]
#: When the error is below half the handout's tolerance, the turn must end within this time [s].
MAX_STOP_TIME = 0.5
FINE_STOP_TIME = 2.5                # [s] for a node whose tolerance is finer than the handout's


def find_wrong_heading(node_run: NodeRun) -> Iterator[Mistake]:
    """Yields a Mistake if the variable curr_yaw is not a usable heading."""
    series = node_run.variable('curr_yaw')
    if series is not None and own_heading(node_run) is None:
        correct = heading_candidates(node_run)[0]
        yield heading_mistake(series, correct, quantity_of_curr_yaw(node_run))


def find_wrong_goal_yaw(node_run: NodeRun) -> Iterator[Mistake]:
    """Yields a Mistake for each letter that sets goal_yaw to a wrong angle, or not at all."""
    series = node_run.variable('curr_yaw')
    heading = own_heading(node_run)
    goal = node_run.variable('goal_yaw')
    turning = node_run.boolean_variable('turning')
    if series is None or heading is None or goal is None:
        return
    correct_turn = None
    for turn in letter_turns(node_run):
        if turning is not None and turning.at(turn.begin) == 1.0:
            continue        # the node is still in the previous turn, and has not read the letter
        if has_correct_goal(turn, heading.per_degree):
            correct_turn = correct_turn or turn
            continue
        behaviour = 'stayed' if turn.goal_before == turn.goal_after else 'became'
        message = (f'after {turn.letter}, with {series.name} {turn.begin_yaw:.4g}, {goal.name} '
                   f'{behaviour} {shortened_value(turn.goal_after)}; it should be '
                   + correct_goal_text(turn, heading.per_degree))
        if correct_turn is not None:
            message += (f'; after {correct_turn.letter} with {correct_turn.begin_yaw:.4g} '
                        'it was right')
        yield Mistake(message, turn.begin, goal.name)


def has_correct_goal(turn: NodeTurn, per_degree: float) -> bool:
    """Returns True if a letter sets goal_yaw correctly. An unknown letter may be l or r."""
    change = (to_number(turn.goal_after) - turn.begin_yaw) / per_degree
    change_deg = float(wrap_all(change, 360.0))
    requested_deg = TURN_OF_LETTER_DEG[turn.letter]
    if turn.letter == UNKNOWN_LETTER:
        requested_deg = math.copysign(TURN_DEG, change_deg)
    return bool(abs(wrap_all(change_deg - requested_deg, 360.0)) <= GOAL_TOLERANCE_DEG)


def correct_goal_text(turn: NodeTurn, per_degree: float) -> str:
    if turn.letter == UNKNOWN_LETTER:
        return f'{TURN_DEG * per_degree:g} more or less'
    goal = turn.begin_yaw + TURN_OF_LETTER_DEG[turn.letter] * per_degree
    return f'{goal % (360.0 * per_degree):.4g}'


def find_ignored_letter(node_run: NodeRun) -> Iterator[Mistake]:
    """Yields a Mistake for each letter after which `turning` does not become True."""
    turning = node_run.boolean_variable('turning')
    if turning is None:
        return
    for turn in letter_turns(node_run):
        end = min(turn.end, turn.begin + 1.0)
        readings = turning.between(turn.begin + MAX_FIRST_COMMAND_DELAY, end)
        stayed_false = len(readings.value) >= MIN_FALSE_READINGS and not readings.value.any()
        if stayed_false and not len(turn.moving_indices):
            clause = ''
            if len(turn.error) and math.isfinite(turn.error[0]):
                clause = f', at an error of {turn.error[0]:+.0f} degrees'
            value = readings.text[-1]
            yield Mistake(f'after {turn.letter}{clause}, {turning.name} stayed {value}, or was '
                          f'{value} again at once', turn.begin, turning.name)


def find_slow_turn_commands(node_run: NodeRun) -> Iterator[Mistake]:
    """Yields a Mistake for each turn whose commands are too far apart, often 0, or too few."""
    for turn in letter_turns(node_run):
        moving = turn.moving_indices
        if len(moving) >= MIN_PACED_COMMANDS:
            first_to_last_moving = slice(moving[0], moving[-1] + 1)
            yield from find_slow_commands(turn.time[first_to_last_moving], turn.begin)
            is_zero = turn.command[first_to_last_moving] == 0.0
            becomes_zero = is_zero[1:] & ~is_zero[:-1]
            if becomes_zero.sum() >= MIN_ZERO_PAUSES:
                yield Mistake(
                    f'{is_zero.sum()} of {len(is_zero)} commands in the turn after {turn.letter} '
                    'were zero: another callback publishes, too', turn.begin)
        elif turn.lacks_zero:
            count = 'once' if len(moving) == 1 else 'twice'
            yield Mistake(f'after {turn.letter} the command {turn.command[-1]:+.2f} rad/s came '
                          f'{count}, and then none', turn.begin)


def find_wrong_turn_command(node_run: NodeRun) -> Iterator[Mistake]:
    """Yields a Mistake for each turn whose commands are 0, wrong in sign, too fast, or forward."""
    for turn in letter_turns(node_run):
        has_only_zeros = len(turn.time) >= MIN_ZERO_COMMANDS and not turn.command.any()
        if has_only_zeros and abs(turn.error[-1]) > CLEAR_ERROR_DEG:
            other_fields = (*UNUSED_FIELDS, ('linear', 'linear.x'))
            other_clause = nonzero_field_text(node_run.commands, other_fields)
            clauses = '; '.join(filter(None, ['angular.z stayed 0', other_clause]))
            yield Mistake(f'after {turn.letter}, for an error of {turn.error[-1]:.0f} degrees, '
                          + clauses, turn.begin, 'angular.z')
    yield from find_wrong_side(node_run)
    yield from find_exceeded_limits(node_run)


def find_wrong_side(node_run: NodeRun) -> Iterator[Mistake]:
    """Yields a Mistake for the first command that turns the robot away from the goal."""
    commands_away = []
    for turn in letter_turns(node_run):
        error_size = np.abs(turn.error)
        has_one_side = (error_size > CLEAR_ERROR_DEG) & (error_size < 180.0 - CLEAR_ERROR_DEG)
        turns_away = (turn.command * turn.error < 0.0) & (np.abs(turn.command) > MIN_TURNING_SPEED)
        commands_away += [(turn, index) for index in np.flatnonzero(has_one_side & turns_away)]
    if len(commands_away) >= MIN_COMMANDS_AWAY:
        turn, index = commands_away[0]
        yield Mistake(turn.command_text(index), turn.time[index], 'angular.z')


def find_exceeded_limits(node_run: NodeRun) -> Iterator[Mistake]:
    """Yields a Mistake for each turn that is too fast, or in which the robot also goes forward."""
    commands = node_run.commands
    for turn in letter_turns(node_run):
        moving = turn.moving_indices
        if not len(moving):
            continue
        fastest = int(np.argmax(np.abs(turn.command)))
        if abs(turn.command[fastest]) > MAX_ANG_Z + SPEED_TOLERANCE:
            yield Mistake(f'{turn.command_text(fastest)}, at most {MAX_ANG_Z:g} are asked for',
                          turn.time[fastest], 'angular.z')
        forward = commands.linear[np.isin(commands.arrival, turn.time[moving])]
        if (np.abs(forward) > SPEED_TOLERANCE).sum() >= MIN_FORWARD_COMMANDS:
            speed = forward[np.argmax(np.abs(forward))]
            yield Mistake(f'in the turn after {turn.letter} linear.x was {speed:.2g}',
                          turn.begin, 'linear.x')


def find_wrong_stop(node_run: NodeRun) -> Iterator[Mistake]:
    """Yields a Mistake for each turn that does not end as in the handout."""
    for turn in letter_turns(node_run):
        if len(turn.moving_indices):
            yield from find_wrong_last_command(node_run, turn)
            yield from find_late_stop(node_run, turn)
    yield from find_turning_still_true(node_run)


def find_wrong_last_command(node_run: NodeRun, turn: NodeTurn) -> Iterator[Mistake]:
    """Yields a Mistake if no zero ends the turn, or if the turn ends outside the tolerance."""
    last = turn.moving_indices[-1]
    if turn.is_ended:
        error = turn.error[last + 1]
        if abs(error) > HDG_TOL + MAX_EXCESS_DEG:
            yield Mistake(
                f'the turn after {turn.letter} was ended at an error of {error:+.0f} degrees; '
                f'{HDG_TOL:g} are the tolerance{own_tolerance_text(node_run)}',
                turn.time[last + 1], 'turning')
    elif turn.lacks_zero:
        yield Mistake(f'no zero followed the last command of the turn after {turn.letter}: '
                      + turn.command_text(last), turn.time[last], 'angular.z')


def find_late_stop(node_run: NodeRun, turn: NodeTurn) -> Iterator[Mistake]:
    """Yields a Mistake if the turn goes on although its error is small."""
    last = turn.moving_indices[-1]
    error_size = np.abs(turn.error[:last + 1])
    small_indices = np.flatnonzero(error_size < HDG_TOL / 2.0)
    if not len(small_indices):
        return
    first = small_indices[0]
    stop_time = turn.time[last] - turn.time[first]
    # a node with a finer tolerance comes nearer to the goal before it ends the turn
    is_fine = error_size[first:].max() < HDG_TOL and (turn.is_ended or turn.is_cut)
    max_stop_time = FINE_STOP_TIME if is_fine else MAX_STOP_TIME
    if stop_time > max_stop_time:
        yield Mistake(f'{turn.command_text(first)}, and the turn after {turn.letter} went on'
                      + own_tolerance_text(node_run), turn.time[first], 'turning')


def own_tolerance_text(node_run: NodeRun) -> str:
    """Returns a clause on the node's HDG_TOL, or '' if HDG_TOL has the value of the handout."""
    series = node_run.variable('hdg_tol')
    if series is None or series.value[-1] == HDG_TOL:
        return ''
    return f'; its HDG_TOL is {shortened_value(series.text[-1])}, the handout has {HDG_TOL:g}'


def find_turning_still_true(node_run: NodeRun) -> Iterator[Mistake]:
    """Yields a Mistake for each letter that is typed while `turning` is still True."""
    turning = node_run.boolean_variable('turning')
    if turning is None or not len(node_run.recording.letters):
        return
    previous_was_cut = False        # a turn that was cut did not reach its goal
    for turn in letter_turns(node_run):
        if turning.at(turn.begin - READING_PERIOD) == 1.0 and not previous_was_cut:
            yield Mistake(f'{turning.name} was still True when {turn.letter} was typed: it did '
                          'not become False at the goal before', turn.begin, turning.name)
        previous_was_cut = turn.is_cut
