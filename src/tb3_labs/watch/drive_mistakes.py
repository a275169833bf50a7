"""Finds the mistakes of a node of the Transformation lab in its control, its state after a reset,
its goal, its commands, the ends of its states, and its silence. drive_pose.py checks its pose.
"""
from itertools import product
from typing import Any, Iterator, List, Optional, Tuple

import numpy as np

from tb3_labs.geometry.arrays import index_before, wrap_all
from tb3_labs.handout import (
    ANGLE_TOLERANCE, DISTANCE_TOLERANCE, DRIVE_SPEED, GAIN_TO_FINAL, GAIN_TO_GOAL, GOAL_REACHED,
    MAX_LINEAR_SPEED, MOVE_FORWARD, ROTATE_TO_FINAL, ROTATE_TO_GOAL, STATES)
from tb3_labs.watch.drive_states import (
    HANDOUT_GOAL, MAX_PROBE_DELAY, MIN_CORRECT_SHARE, POSE_TOLERANCE, PROBE_DELAY, StateInterval,
    control_intervals, local_frames, node_poses, radians_per_unit, state_intervals)
from tb3_labs.watch.mistake import (
    SPEED_TOLERANCE, Mistake, NodeRun, find_slow_commands, is_constant)
from tb3_labs.watch.variables import shortened_value

TOLERANCES = {ROTATE_TO_GOAL: ANGLE_TOLERANCE, MOVE_FORWARD: DISTANCE_TOLERANCE,
              ROTATE_TO_FINAL: ANGLE_TOLERANCE}      # [rad] or [m]
#: Each mistake is reported only if at least this many readings or commands show it.
MIN_WRONG_READINGS = 5
MIN_WRONG_TURNS = 3
MIN_LATE_COMMANDS = 4
MIN_FITTED_COMMANDS = 5
MIN_PACED_COMMANDS = 4
MAX_GOAL_ERROR = 1e-3       # [m, rad, deg], because a node may round its goal
GAIN_TOLERANCE_SHARE = 0.05
COMMAND_TOLERANCE_SHARE = 0.03
#: Commands that change by less than this [rad/s] do not show by which formula they were computed.
MIN_COMMAND_CHANGE = 0.1
#: With this heading error [rad] or more, the robot may turn to either side.
EITHER_SIDE_ERROR = 3.0
#: A node must send the first command in a state, and leave a finished state, within this time [s].
MAX_REACTION_TIME = 1.0
GAINS = {ROTATE_TO_GOAL: GAIN_TO_GOAL, ROTATE_TO_FINAL: GAIN_TO_FINAL}      # [1/s]


def find_wrong_control(node_run: NodeRun) -> Iterator[Mistake]:
    """Yields a Mistake for each message on ctrl_relinq that has_control does not follow."""
    series = node_run.variable('has_control')
    if series is None:
        yield from find_inverted_control(node_run)
        return
    for begin, end, value in control_intervals(node_run):
        if not node_run.runs_at(begin):     # the node did not receive the message
            continue
        readings_end = min(end, node_run.last_reading_before_gap(begin))
        readings = series.between(begin + MAX_PROBE_DELAY, readings_end)
        wrong_count = (readings.value == 1.0 - value).sum()
        if wrong_count >= MIN_WRONG_READINGS and wrong_count > len(readings.value) / 2:
            delay = readings.time[-1] - begin
            yield Mistake(f'{delay:.1f} s after a {bool(value)} on ctrl_relinq {series.name} '
                          f'was {readings.text[-1]}', readings.time[0], series.name)


def find_inverted_control(node_run: NodeRun) -> Iterator[Mistake]:
    """Yields a Mistake if the node drives after a False on ctrl_relinq, and never after a True."""
    commands = node_run.commands
    moving = commands.take((commands.linear != 0.0) | (commands.angular != 0.0))
    intervals = [(begin, moving.between(begin + MAX_PROBE_DELAY, end), value)
                 for begin, end, value in control_intervals(node_run)
                 if node_run.runs_at(begin) and end - begin > MAX_REACTION_TIME]
    has_both_values = len({value for _, _, value in intervals}) == 2
    drives_after_true = any(len(sent) for _, sent, value in intervals if value)
    if drives_after_true or not has_both_values:
        return
    for begin, sent, _ in intervals:
        if len(sent) >= MIN_LATE_COMMANDS:
            yield Mistake(f'after a False on ctrl_relinq {len(sent)} commands moved the robot, and '
                          'after a True none: the node uses the value the wrong way round', begin)


def find_unreset_state(node_run: NodeRun) -> Iterator[Mistake]:
    """Yields a Mistake for each reset that does not set `state` to ROTATE_TO_GOAL."""
    series = node_run.variable('state')
    if series is None:
        return
    for frame in local_frames(node_run):
        state_before = series.text_at(frame.begin - PROBE_DELAY)
        if not frame.is_reset or state_before not in STATES[1:]:
            continue
        first_states = series.between(frame.begin, frame.begin + MAX_PROBE_DELAY).text
        later = series.between(frame.begin + MAX_PROBE_DELAY, frame.end)
        stayed = len(later.text) > 0 and later.text[0] == state_before
        if not stayed or ROTATE_TO_GOAL in first_states:
            continue
        # a robot that already faces its goal may leave ROTATE_TO_GOAL before the probe shows it
        error = node_poses(node_run, later.time[:1]).error(ROTATE_TO_GOAL)[0]
        if error > TOLERANCES[ROTATE_TO_GOAL] + POSE_TOLERANCE:
            yield Mistake(f'{frame.clause}{series.name} stayed {state_before}; it should be '
                          + ROTATE_TO_GOAL, frame.begin, series.name)


def find_wrong_goal(node_run: NodeRun) -> Iterator[Mistake]:
    """Yields a Mistake for each constant variable of the goal that has a wrong value."""
    goals = node_run.recording.goals
    if not len(goals) or not len(node_run.recording.starts):
        return      # outside a trial, the recorded goals may be for another node
    for name, requested in zip(HANDOUT_GOAL, (goals.x[0], goals.y[0], goals.yaw[0])):
        series = node_run.variable(name)
        if series is None or not is_constant(series):
            continue
        error = abs(series.value[-1] - requested)
        if 'yaw' in name:       # the node may have its goal_yaw in degrees
            error = min(error, abs(series.value[-1] - np.degrees(requested)))
        if error > MAX_GOAL_ERROR:
            value = shortened_value(series.text[-1])
            yield Mistake(f'{series.name} is {value}; it should be {requested:g}',
                          series.time[0], series.name)


def heading_errors(node_run: NodeRun,
                   interval: StateInterval) -> Iterator[Tuple[str, np.ndarray, bool]]:
    """Yields (formula, heading errors [rad], is_normalized) for each formula that a node may use
    for its heading error. The correct formula is first. There is an error for each command."""
    dx, dy = interval.pose.to_goal.real, interval.pose.to_goal.imag
    targets = [('atan2(dy, dx)', np.arctan2(dy, dx)), ('goal_yaw', interval.pose.goal_yaw)]
    if interval.state != ROTATE_TO_GOAL:
        targets.reverse()       # the correct target is first
    targets += [('atan2(dx, dy)', np.arctan2(dx, dy)), ('atan(dy / dx)', np.arctan(dy / dx))]
    goal_yaw = node_run.variable('goal_yaw')
    if goal_yaw is not None and radians_per_unit(goal_yaw) < 1.0:
        # a node that does not convert its goal_yaw takes the number of degrees for radians
        targets.append(('goal_yaw in degrees', np.degrees(interval.pose.goal_yaw)))
    imu = node_run.recording.imu
    newest_indices = index_before(imu.arrival, interval.commands.arrival).clip(0)
    headings = [('local_yaw', interval.pose.yaw), ('the yaw of the IMU', imu.yaw[newest_indices]),
                ('0', np.zeros(len(newest_indices)))]
    for (target, target_yaw), (heading, yaw) in product(targets, headings):
        yield f'{target} - {heading}', wrap_all(target_yaw - yaw), True
        yield f'{target} - {heading}, not normalized', target_yaw - yaw, False


def fitted_formula(node_run: NodeRun, interval: StateInterval) -> Tuple[str, float]:
    """Returns (formula, gain), such that each command is the gain times the heading error by the
    formula. A formula with the handout's gain is preferred. If none fits, the formula is ''."""
    handout_gain = GAINS[interval.state]
    fits = []
    for formula, error, is_normalized in heading_errors(node_run, interval):
        gain = fitted_gain(error, is_normalized, interval.commands.angular, handout_gain)
        if gain is not None:
            fits.append((formula, gain))
    if not fits:
        return '', handout_gain
    preferred = [(formula, gain) for formula, gain in fits if abs(gain) == handout_gain]
    return preferred[0] if preferred else fits[0]


def fitted_gain(error: np.ndarray, is_normalized: bool, command: np.ndarray,
                handout_gain: float) -> Optional[float]:
    """Returns the gain for which the commands are the gain times the error, or None."""
    is_used = (command != 0.0) & (error != 0.0)
    if is_normalized:
        is_used &= np.abs(error) < EITHER_SIDE_ERROR
    command, error = command[is_used], error[is_used]
    if len(error) < MIN_FITTED_COMMANDS:
        return None
    gain = float(np.median(command / error))
    if np.isclose(abs(gain), handout_gain, rtol=GAIN_TOLERANCE_SHARE):
        gain = float(np.copysign(handout_gain, gain))
    elif np.ptp(command) < MIN_COMMAND_CHANGE:
        return None     # the commands are nearly constant, and the gain is not the handout's
    is_near = np.isclose(command, gain * error, rtol=COMMAND_TOLERANCE_SHARE, atol=SPEED_TOLERANCE)
    return gain if is_near.mean() >= MIN_CORRECT_SHARE else None


def find_wrong_law(node_run: NodeRun) -> Iterator[Mistake]:
    """Yields a Mistake for each state with wrong commands, or with a wrong end."""
    for interval in state_intervals(node_run):
        if interval.state not in TOLERANCES:
            yield from find_unknown_state(interval)
            continue
        if interval.end - interval.begin >= MAX_REACTION_TIME:
            yield from find_wrong_drive_command(node_run, interval)
        yield from find_early_end(node_run, interval)
        if not interval.next_state:
            yield from find_missing_end(node_run, interval)


def find_unknown_state(interval: StateInterval) -> Iterator[Mistake]:
    """Yields a Mistake if the node stays in a state that the handout does not have."""
    is_known = interval.state in STATES or interval.next_state in STATES
    if not is_known and interval.end - interval.begin >= MAX_REACTION_TIME:
        yield Mistake(f"state became {interval.state}, which is none of {', '.join(STATES)}",
                      interval.begin, 'state')


def find_wrong_drive_command(node_run: NodeRun, interval: StateInterval) -> Iterator[Mistake]:
    """Yields a Mistake if a state has no commands, or wrong commands."""
    if not len(interval.commands):
        yield from find_missing_commands(node_run, interval)
    elif interval.state == MOVE_FORWARD:
        speed = np.median(interval.commands.linear)
        if speed <= 0.0 or speed > MAX_LINEAR_SPEED + SPEED_TOLERANCE:
            yield Mistake(f'in {interval.state} linear.x was {speed:.2f}, by the handout it is '
                          f'{DRIVE_SPEED:g}', interval.begin, 'linear.x')
    else:
        yield from find_wrong_rotation(node_run, interval)


def find_missing_commands(node_run: NodeRun, interval: StateInterval) -> Iterator[Mistake]:
    """Yields a Mistake if a state without commands is too long. The time until the first messages
    of both the IMU and the odometry does not count, because a node may wait for them."""
    recording = node_run.recording
    received = [samples.between(interval.begin, interval.end)
                for samples in (recording.imu, recording.odometry)]
    first_arrivals = [min(samples.arrival, default=np.inf) for samples in received]
    if interval.end - max(first_arrivals) >= MAX_REACTION_TIME:
        duration = interval.end - interval.begin
        yield Mistake(f'in {interval.state} no command came for {duration:.1f} s', interval.begin)


def find_wrong_rotation(node_run: NodeRun, interval: StateInterval) -> Iterator[Mistake]:
    """Yields a Mistake for a wrong formula of turning commands, and for a wrong sign."""
    formula, gain = fitted_formula(node_run, interval)
    correct, error, _ = next(heading_errors(node_run, interval))
    angular = interval.commands.angular
    clause = f'in {interval.state} angular.z was '
    if formula and (formula != correct or gain < 0.0):
        yield Mistake(f'{clause}{gain:.2g} x ({formula}); by the handout it is '
                      f'{GAINS[interval.state]:g} x ({correct})', interval.begin, 'angular.z')

    # if the error is small or almost half a turn, a command to either side may be correct
    size = np.abs(error)
    has_one_side = (size > 2.0 * TOLERANCES[interval.state]) & (size < EITHER_SIDE_ERROR)
    turns_away = angular * error < 0.0
    never_turns = not angular.any()
    wrong_indices = np.flatnonzero(has_one_side & (turns_away | never_turns))
    if len(wrong_indices) >= MIN_WRONG_TURNS:
        first = wrong_indices[0]
        yield Mistake(f'{clause}{angular[first]:+.2f} for an error of {error[first]:+.2f} rad',
                      interval.commands.arrival[first], 'angular.z')


def find_early_end(node_run: NodeRun, interval: StateInterval) -> Iterator[Mistake]:
    """Yields a Mistake for each state that the node leaves or skips too early."""
    if interval.next_state not in STATES:
        return
    first, after_last = STATES.index(interval.state), STATES.index(interval.next_state)
    for state in STATES[first:after_last]:
        error = node_poses(node_run, np.array([interval.end])).error(state)[0]
        if error > TOLERANCES[state] + POSE_TOLERANCE:
            yield Mistake(f'state went from {interval.state} to {interval.next_state} at '
                          + error_with_tolerance(state, error), interval.end, 'state')


def find_missing_end(node_run: NodeRun, interval: StateInterval) -> Iterator[Mistake]:
    """Yields a Mistake if the node stays in a state although the error is small."""
    all_times = node_run.reading_times
    times = all_times[(all_times >= interval.begin) & (all_times <= interval.end)]
    error = node_poses(node_run, times).error(interval.state)
    tolerance = TOLERANCES[interval.state]
    small_indices = np.flatnonzero(error < tolerance)
    if not len(small_indices):
        return
    first, last = small_indices[0], small_indices[-1]
    small_at = times[first]
    if interval.end - small_at <= MAX_REACTION_TIME:
        return
    # a node with a finer tolerance still turns towards its goal, which is no mistake
    error_grew = error[first:].max() > tolerance + POSE_TOLERANCE
    is_later = interval.commands.arrival > small_at + MAX_PROBE_DELAY
    still_turns = interval.commands.angular[is_later].any()
    if error_grew or not still_turns:
        error_clause = error_with_tolerance(interval.state, error[last])
        yield Mistake(f'state stayed {interval.state} at {error_clause}', times[last], 'state')


def error_with_tolerance(state: str, error: float) -> str:
    size = f'heading error of {error:.2f} rad'
    if state == MOVE_FORWARD:
        size = f'distance of {error:.2f} m'
    return f'a {size}; {TOLERANCES[state]:g} is the tolerance'


def find_late_commands(node_run: NodeRun) -> Iterator[Mistake]:
    """Yields a Mistake if a node still sends commands at the goal or without control. Also yields a
    Mistake if the last command before this silence is not zero."""
    commands = node_run.commands
    is_moving = (commands.linear != 0.0) | (commands.angular != 0.0)
    for begin, end, cause, may_send_zeros in required_silences(node_run):
        seen_at = begin + MAX_PROBE_DELAY
        if end <= seen_at:
            continue
        is_late = (commands.arrival > seen_at) & (commands.arrival < end)
        if may_send_zeros:
            is_late &= is_moving
        late_indices = np.flatnonzero(is_late)
        if len(late_indices) >= MIN_LATE_COMMANDS:
            first = late_indices[0]
            yield Mistake(f'{cause}, and {len(late_indices)} commands came later: '
                          + command_text(commands, first), commands.arrival[first])

        is_recent = (commands.arrival > begin - 1.0) & (commands.arrival < seen_at)
        recent_indices = np.flatnonzero(is_recent)
        if len(recent_indices) and is_moving[recent_indices[-1]]:
            last_text = command_text(commands, recent_indices[-1])
            yield Mistake(f'{cause}, and the last command was {last_text}: no zero followed', begin)


def required_silences(node_run: NodeRun) -> List[Tuple[float, float, str, bool]]:
    """Returns (begin [s], end [s], cause, may_send_zeros) of each interval in which the node must
    send no commands. Without control, the node may still send zeros."""
    silences = [(begin, end, 'ctrl_relinq became False', True)
                for begin, end, value in control_intervals(node_run)
                if not value and node_run.runs_at(begin)]
    silences += [(interval.begin, interval.end, 'state became ' + GOAL_REACHED, False)
                 for interval in state_intervals(node_run) if interval.state == GOAL_REACHED]
    return sorted(silences)


def command_text(commands: Any, index: int) -> str:
    return f'linear.x {commands.linear[index]:.2f}, angular.z {commands.angular[index]:.2f}'


def find_slow_drive_commands(node_run: NodeRun) -> Iterator[Mistake]:
    """Yields a Mistake for each state whose commands are too far apart."""
    for interval in state_intervals(node_run):
        if len(interval.commands) >= MIN_PACED_COMMANDS and interval.state in TOLERANCES:
            yield from find_slow_commands(interval.commands.arrival, interval.begin)
