"""Finds the mistakes of a node of the Transformation lab, in this order: control, state after a
reset, goal, command and end of each state, silence. The local pose is in drive_pose.py.
"""
from itertools import product
from typing import Any, Iterator, Optional, Tuple

import numpy as np

from tb3_labs.geometry.arrays import index_before, wrap_all
from tb3_labs.handout import (
    ANGLE_TOLERANCE, DISTANCE_TOLERANCE, DRIVE_SPEED, GAIN_TO_FINAL, GAIN_TO_GOAL, GOAL_REACHED,
    MAX_LINEAR_SPEED, MOVE_FORWARD, ROTATE_TO_FINAL, ROTATE_TO_GOAL, STATES)
from tb3_labs.watch.drive_states import (
    HANDOUT_GOAL, MAX_PROBE_DELAY, MIN_CORRECT_SHARE, POSE_TOLERANCE, PROBE_DELAY, StateInterval,
    control_intervals, local_frames, node_poses, state_intervals)
from tb3_labs.watch.mistake import (
    SPEED_TOLERANCE, Mistake, NodeRun, find_slow_commands, is_constant)
from tb3_labs.watch.variables import shortened_value

TOLERANCES = {ROTATE_TO_GOAL: ANGLE_TOLERANCE, MOVE_FORWARD: DISTANCE_TOLERANCE,
              ROTATE_TO_FINAL: ANGLE_TOLERANCE}      # [rad] or [m]
#: A mistake is reported if at least this many readings or commands show it.
MIN_WRONG_READINGS = 5
MIN_WRONG_TURNS = 3
MIN_LATE_COMMANDS = 4
MIN_FITTED_COMMANDS = 5
MIN_PACED_COMMANDS = 4
MAX_GOAL_ERROR = 1e-3       # [m, rad, deg], by the rounding of a number
GAIN_TOLERANCE_SHARE = 0.05
COMMAND_TOLERANCE_SHARE = 0.03
#: Commands that change by less than this [rad/s] fit any constant error, so they show no formula.
MIN_COMMAND_CHANGE = 0.1
#: With this heading error [rad] or more, the robot may turn to either side.
EITHER_SIDE_ERROR = 3.0
MAX_REACTION_TIME = 1.0     # [s], to send the first command in a state, or to leave a state
GAINS = {ROTATE_TO_GOAL: GAIN_TO_GOAL, ROTATE_TO_FINAL: GAIN_TO_FINAL}      # [1/s]


def find_wrong_control(node_run: NodeRun) -> Iterator[Mistake]:
    """Yields a Mistake for each message on ctrl_relinq that has_control does not follow."""
    series = node_run.variable('has_control')
    if series is None:
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


def find_unreset_state(node_run: NodeRun) -> Iterator[Mistake]:
    """Yields a Mistake for each reset that does not set `state` to ROTATE_TO_GOAL."""
    series = node_run.variable('state')
    if series is None:
        return
    for frame in local_frames(node_run):
        state = series.text_at(frame.begin - PROBE_DELAY)
        if not frame.is_reset or state not in STATES[1:]:
            continue
        first_states = series.between(frame.begin, frame.begin + MAX_PROBE_DELAY).text
        readings = series.between(frame.begin + MAX_PROBE_DELAY, frame.end)
        stayed = state in readings.text[:1]
        if not stayed or ROTATE_TO_GOAL in first_states:
            continue
        error = node_poses(node_run, readings.time[:1]).error(ROTATE_TO_GOAL)[0]
        if error > TOLERANCES[ROTATE_TO_GOAL] + POSE_TOLERANCE:
            yield Mistake(f'{frame.clause}{series.name} stayed {state}; it should be '
                          + ROTATE_TO_GOAL, frame.begin, series.name)


def find_wrong_goal(node_run: NodeRun) -> Iterator[Mistake]:
    """Yields a Mistake for each constant variable of the goal that has a wrong value."""
    goals = node_run.recording.goals
    if not len(goals) or not len(node_run.recording.starts):
        return      # outside a trial, the goals may be for another node
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
    """Yields (formula, heading errors [rad], is_normalized), with the correct formula first."""
    dx, dy = interval.pose.to_goal.real, interval.pose.to_goal.imag
    targets = [('atan2(dy, dx)', np.arctan2(dy, dx)), ('goal_yaw', interval.pose.goal_yaw)]
    if interval.state != ROTATE_TO_GOAL:
        targets.reverse()
    targets += [('atan2(dx, dy)', np.arctan2(dx, dy)), ('atan(dy / dx)', np.arctan(dy / dx))]
    imu = node_run.recording.imu
    latest = index_before(imu.arrival, interval.commands.arrival).clip(0)
    headings = [('local_yaw', interval.pose.yaw), ('the yaw of the IMU', imu.yaw[latest]),
                ('0', np.zeros(len(latest)))]
    for (target, target_yaw), (heading, yaw) in product(targets, headings):
        yield f'{target} - {heading}', wrap_all(target_yaw - yaw), True
        yield f'{target} - {heading}, not normalized', target_yaw - yaw, False


def fitted_formula(node_run: NodeRun, interval: StateInterval) -> Tuple[str, float]:
    """Returns (formula of the heading error, gain), such that the commands are the gain times the
    error. A formula with the handout's gain is preferred. The formula is '' if none fits."""
    handout_gain = GAINS[interval.state]
    fits = []
    for formula, error, is_normalized in heading_errors(node_run, interval):
        gain = fitted_gain(error, is_normalized, interval.commands.angular, handout_gain)
        if gain is not None:
            fits.append((formula, gain))
    with_handout_gain = [fit for fit in fits if abs(fit[1]) == handout_gain]
    return next(iter(with_handout_gain or fits), ('', handout_gain))


def fitted_gain(error: np.ndarray, is_normalized: bool, command: np.ndarray,
                handout_gain: float) -> Optional[float]:
    """Returns the gain by which the commands are the gain times the error; None if none fits."""
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
        return None
    is_near = np.isclose(command, gain * error, rtol=COMMAND_TOLERANCE_SHARE, atol=SPEED_TOLERANCE)
    return gain if is_near.mean() >= MIN_CORRECT_SHARE else None


def find_wrong_law(node_run: NodeRun) -> Iterator[Mistake]:
    """Yields a Mistake for each mistake in the commands or at the end of a state."""
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
        # after a reset, a node may wait for the IMU and the odometry
        recording = node_run.recording
        received = [samples.between(interval.begin, interval.end)
                    for samples in (recording.imu, recording.odometry)]
        first_arrivals = [min(samples.arrival, default=np.inf) for samples in received]
        if interval.end - max(first_arrivals) >= MAX_REACTION_TIME:
            duration = interval.end - interval.begin
            yield Mistake(f'in {interval.state} no command came for {duration:.1f} s',
                          interval.begin)
    elif interval.state == MOVE_FORWARD:
        speed = np.median(interval.commands.linear)
        if speed <= 0.0 or speed > MAX_LINEAR_SPEED + SPEED_TOLERANCE:
            yield Mistake(f'in {interval.state} linear.x was {speed:.2f}, by the handout it is '
                          f'{DRIVE_SPEED:g}', interval.begin, 'linear.x')
    else:
        yield from find_wrong_rotation(node_run, interval)


def find_wrong_rotation(node_run: NodeRun, interval: StateInterval) -> Iterator[Mistake]:
    """Yields a Mistake for a wrong formula of turning commands, and for a wrong sign."""
    formula, gain = fitted_formula(node_run, interval)
    correct, error, _ = next(heading_errors(node_run, interval))
    angular = interval.commands.angular
    clause = f'in {interval.state} angular.z was '
    if formula and (formula != correct or gain < 0.0):
        yield Mistake(f'{clause}{gain:.2g} x ({formula}); by the handout it is '
                      f'{GAINS[interval.state]:g} x ({correct})', interval.begin, 'angular.z')
    is_large = np.abs(error) > 2.0 * TOLERANCES[interval.state]
    has_one_side = np.abs(error) < EITHER_SIDE_ERROR
    is_wrong = is_large & has_one_side
    if angular.any():       # a node that never turns is wrong at every such error
        is_wrong &= angular * error < 0.0
    wrong_indices = np.flatnonzero(is_wrong)
    if len(wrong_indices) >= MIN_WRONG_TURNS:
        k = wrong_indices[0]
        yield Mistake(f'{clause}{angular[k]:+.2f} for an error of {error[k]:+.2f} rad',
                      interval.commands.arrival[k], 'angular.z')


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
    near_indices = np.flatnonzero(error < tolerance)
    if not len(near_indices):
        return
    first, last = near_indices[0], near_indices[-1]
    if interval.end - times[first] <= MAX_REACTION_TIME:
        return
    is_passed = error[first:].max() > tolerance + POSE_TOLERANCE
    is_later = interval.commands.arrival > times[first] + MAX_PROBE_DELAY
    is_turning = interval.commands.angular[is_later].any()
    if is_passed or not is_turning:
        error_clause = error_with_tolerance(interval.state, error[last])
        yield Mistake(f'state stayed {interval.state} at {error_clause}', times[last], 'state')


def error_with_tolerance(state: str, error: float) -> str:
    size = f'heading error of {error:.2f} rad'
    if state == MOVE_FORWARD:
        size = f'distance of {error:.2f} m'
    return f'a {size}; {TOLERANCES[state]:g} is the tolerance'


def find_late_commands(node_run: NodeRun) -> Iterator[Mistake]:
    """Yields a Mistake if commands go on, or lack a zero, at the goal or without control."""
    commands = node_run.commands
    is_moving = (commands.linear != 0.0) | (commands.angular != 0.0)
    # without control, a node may send zeros
    silences = [(begin, end, 'ctrl_relinq became False', True)
                for begin, end, value in control_intervals(node_run)
                if not value and node_run.runs_at(begin)]
    silences += [(interval.begin, interval.end, 'state became ' + GOAL_REACHED, False)
                 for interval in state_intervals(node_run) if interval.state == GOAL_REACHED]
    for begin, end, cause, may_send_zeros in sorted(silences):
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
            last = command_text(commands, recent_indices[-1])
            yield Mistake(f'{cause}, and the last command was {last}: no zero followed', begin)


def command_text(commands: Any, k: int) -> str:
    return f'linear.x {commands.linear[k]:.2f}, angular.z {commands.angular[k]:.2f}'


def find_slow_drive_commands(node_run: NodeRun) -> Iterator[Mistake]:
    """Yields a Mistake for each state whose commands are too far apart."""
    for interval in state_intervals(node_run):
        if len(interval.commands) >= MIN_PACED_COMMANDS and interval.state in TOLERANCES:
            yield from find_slow_commands(interval.commands.arrival, interval.begin)
