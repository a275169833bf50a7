"""Checks the chain of the Transformation lab: control -> state after a reset -> references -> local
pose -> goal -> command and end of each state -> silence.
"""
from itertools import product
from typing import Any, Iterator, Sequence, Tuple

import numpy as np

from tb3_labs.geometry.arrays import last_before, wrap_all
from tb3_labs.handout import (
    ANGLE_TOLERANCE, DISTANCE_TOLERANCE, DRIVE_SPEED, GAIN_TO_FINAL, GAIN_TO_GOAL, GOAL_REACHED,
    MAX_LINEAR_SPEED, MOVE_FORWARD, ROTATE_TO_FINAL, ROTATE_TO_GOAL, STATES)
from tb3_labs.watch.broken_link import (
    BrokenLink, NodeRun, is_constant, should_be, slow_commands)
from tb3_labs.watch.drive_states import (
    HANDOUT_GOAL, MAX_PROBE_LAG, POSE_TOLERANCE, RIGHT_SHARE, SHORT_LAG, StateInterval,
    control_intervals, local_frames, own_pose, state_intervals)
from tb3_labs.watch.variables import shortened_value

#: The tolerance of each state, an angle [rad] or a distance [m].
TOLERANCES = {ROTATE_TO_GOAL: ANGLE_TOLERANCE, MOVE_FORWARD: DISTANCE_TOLERANCE,
              ROTATE_TO_FINAL: ANGLE_TOLERANCE}
MIN_WRONG_READINGS = 4
#: If the heading error [rad] is larger, the robot may turn to either side.
MAX_CLEAR_ERROR = 3.0
#: The gain [1/s] of each rotation.
GAINS = {ROTATE_TO_GOAL: GAIN_TO_GOAL, ROTATE_TO_FINAL: GAIN_TO_FINAL}


def wrong_control(node_run: NodeRun) -> Iterator[BrokenLink]:
    """Checks that has_control follows ctrl_relinq."""
    series = node_run.variable('has_control')
    if series is None:
        return
    for begin, end, value in control_intervals(node_run):
        if not node_run.runs_at(begin):     # the node did not receive the message
            continue
        part = series.between(begin + MAX_PROBE_LAG, min(end, node_run.end_after(begin)))
        is_opposite = part.value == 1.0 - value
        if is_opposite.sum() > max(MIN_WRONG_READINGS, len(is_opposite) / 2):
            yield BrokenLink(f'{part.time[-1] - begin:.1f} s after a {bool(value)} on ctrl_relinq '
                             f'{series.name} was {part.text[-1]}', part.time[0], series.name)


def state_not_reset(node_run: NodeRun) -> Iterator[BrokenLink]:
    """Checks that each reset sets the variable `state` to ROTATE_TO_GOAL."""
    series = node_run.variable('state')
    if series is None:
        return
    for frame in node_run.cached(local_frames):
        state = series.text_at(frame.begin - SHORT_LAG)
        soon = series.between(frame.begin, frame.begin + MAX_PROBE_LAG).text
        part = series.between(frame.begin + MAX_PROBE_LAG, frame.end)
        stays = len(part.text) > 0 and part.text[0] == state
        is_kept = state in STATES[1:] and stays and ROTATE_TO_GOAL not in soon
        if not frame.is_reset or not is_kept:
            continue
        error = own_pose(node_run, part.time[:1]).error(ROTATE_TO_GOAL)[0]
        if error > TOLERANCES[ROTATE_TO_GOAL] + POSE_TOLERANCE:
            yield BrokenLink(should_be(f'{frame.clause}{series.name} stayed {state}',
                                       ROTATE_TO_GOAL), frame.begin, series.name)


def wrong_goal(node_run: NodeRun) -> Iterator[BrokenLink]:
    """Checks that the constant variables of the goal have the requested values."""
    goals = node_run.run.goals
    if not len(goals) or not len(node_run.run.starts):
        return      # outside a trial, the goals may be for another node
    for name, requested in zip(HANDOUT_GOAL, (goals.x[0], goals.y[0], goals.yaw[0])):
        series = node_run.variable(name)
        if series is None or not is_constant(series):
            continue
        error = abs(series.value[-1] - requested)
        if 'yaw' in name:       # the node may have its goal_yaw in degrees
            error = min(error, abs(series.value[-1] - np.degrees(requested)))
        if error > 1e-3:
            message = should_be(f'{series.name} is {shortened_value(series.text[-1])}',
                                f'{requested:g}')
            yield BrokenLink(message, series.time[0], series.name)


def heading_errors(node_run: NodeRun, part: StateInterval) -> Iterator[Tuple[str, np.ndarray]]:
    """Yields (formula, heading errors [rad]) for each possible formula, first the correct
    formula."""
    dx, dy = part.pose.to_goal.real, part.pose.to_goal.imag
    targets = [('atan2(dy, dx)', np.arctan2(dy, dx)), ('goal_yaw', part.pose.goal_yaw)]
    if part.state != ROTATE_TO_GOAL:
        targets.reverse()
    targets += [('atan2(dx, dy)', np.arctan2(dx, dy)), ('atan(dy / dx)', np.arctan(dy / dx))]
    imu = node_run.run.imu
    latest = last_before(imu.arrival, part.commands.arrival).clip(0)
    yaws = [('local_yaw', part.pose.yaw), ('the yaw of the IMU', imu.yaw[latest]),
            ('0', np.zeros(len(latest)))]
    for (target, angle), (heading, turned) in product(targets, yaws):
        yield f'{target} - {heading}', wrap_all(angle - turned)
        yield f'{target} - {heading}, not normalized', angle - turned


def fitted_formula(node_run: NodeRun, part: StateInterval) -> Tuple[str, float]:
    """Returns (formula, gain). In a rotation, a command is the gain times the heading error. The
    formula computes the heading error. A formula with the handout's gain is preferred. If no
    formula fits, `formula` is ''."""
    requested = GAINS[part.state]
    angular = part.commands.angular
    another = '', requested
    for formula, error in heading_errors(node_run, part):
        is_clear = (np.abs(error) < MAX_CLEAR_ERROR) | ('not normalized' in formula)
        is_used = (angular != 0.0) & (error != 0.0) & is_clear
        command, error = angular[is_used], error[is_used]
        if len(error) < 5:
            continue
        gain = float(np.median(command / error))
        has_handouts_gain = abs(abs(gain) / requested - 1.0) < 0.05
        if has_handouts_gain:
            gain = float(np.copysign(requested, gain))
        is_near = np.abs(command - gain * error) < 0.01 + 0.03 * np.abs(gain * error)
        if is_near.mean() < RIGHT_SHARE:
            continue
        if has_handouts_gain:
            return formula, gain
        # some gain makes any constant angle a constant command
        if not another[0] and np.ptp(command) >= 0.1:
            another = formula, gain
    return another


def wrong_law(node_run: NodeRun) -> Iterator[BrokenLink]:
    """Checks the commands and the end of each state."""
    for part in node_run.cached(state_intervals):
        if part.state not in TOLERANCES:
            yield from unknown_state(part)
            continue
        if part.end - part.begin >= 1.0:
            yield from wrong_command(node_run, part)
        yield from early_end(node_run, part)
        if not part.next_state:
            yield from missing_end(node_run, part)


def unknown_state(part: StateInterval) -> Iterator[BrokenLink]:
    """Checks that the node does not stay in a state that is unknown to the handout."""
    is_left = part.next_state in STATES or part.end - part.begin < 1.0
    if part.state not in STATES and not is_left:
        yield BrokenLink(f"state became {part.state}, which is none of {', '.join(STATES)}",
                         part.begin, 'state')


def wrong_command(node_run: NodeRun, part: StateInterval) -> Iterator[BrokenLink]:
    """Checks that the node sends commands in a state, and that the commands are correct."""
    if not len(part.commands):
        # after a reset, a node may wait for the IMU and the odometry
        both_came_at = max(min(samples.between(part.begin, part.end).arrival, default=np.inf)
                           for samples in (node_run.run.imu, node_run.run.odometry))
        if part.end - both_came_at >= 1.0:
            yield BrokenLink(f'in {part.state} no command came for {part.end - part.begin:.1f} s',
                             part.begin)
    elif part.state == MOVE_FORWARD:
        speed = np.median(part.commands.linear)
        if speed <= 0.0 or speed > MAX_LINEAR_SPEED + 0.01:
            yield BrokenLink(f'in {part.state} linear.x was {speed:.2f}, by the handout it is '
                             f'{DRIVE_SPEED:g}', part.begin, 'linear.x')
    else:
        yield from wrong_rotation(node_run, part)


def wrong_rotation(node_run: NodeRun, part: StateInterval) -> Iterator[BrokenLink]:
    """Checks that turning commands follow the correct error, and have the correct sign."""
    formula, gain = fitted_formula(node_run, part)
    correct, error = next(heading_errors(node_run, part))
    angular = part.commands.angular
    text = f'in {part.state} angular.z was '
    if formula and (formula != correct or gain < 0.0):
        yield BrokenLink(f'{text}{gain:.2g} x ({formula}); by the handout it is '
                         f'{GAINS[part.state]:g} x ({correct})', part.begin, 'angular.z')
    is_wrong = angular * error < 0.0
    if not angular.any():
        is_wrong[:] = True
    is_large = np.abs(error) > 2.0 * TOLERANCES[part.state]
    is_clear = np.abs(error) < MAX_CLEAR_ERROR
    wrong = np.flatnonzero(is_wrong & is_large & is_clear)
    if len(wrong) > 2:
        k = wrong[0]
        yield BrokenLink(f'{text}{angular[k]:+.2f} for an error of {error[k]:+.2f} rad',
                         part.commands.arrival[k], 'angular.z')


def early_end(node_run: NodeRun, part: StateInterval) -> Iterator[BrokenLink]:
    """Checks that the error is within the tolerance when the node leaves or skips a state."""
    passed: Sequence[str] = ()
    if part.next_state in STATES:
        passed = STATES[STATES.index(part.state):STATES.index(part.next_state)]
    for state in passed:
        error = own_pose(node_run, np.array([part.end])).error(state)[0]
        if error > TOLERANCES[state] + POSE_TOLERANCE:
            yield BrokenLink(f'state went from {part.state} to {part.next_state} at '
                             + error_text(state, error), part.end, 'state')


def missing_end(node_run: NodeRun, part: StateInterval) -> Iterator[BrokenLink]:
    """Checks that the node leaves a state within a second when it is at the goal of the state."""
    times = node_run.reading_times
    times = times[(times >= part.begin) & (times <= part.end)]
    error = own_pose(node_run, times).error(part.state)
    tolerance = TOLERANCES[part.state]
    near = np.flatnonzero(error < tolerance)
    if not len(near) or part.end - times[near[0]] <= 1.0:
        return
    is_passed = error[near[0]:].max() > tolerance + POSE_TOLERANCE
    later = part.commands.arrival > times[near[0]] + MAX_PROBE_LAG
    if is_passed or not part.commands.angular[later].any():
        yield BrokenLink(
            f'state stayed {part.state} at ' + error_text(part.state, error[near[-1]]),
            times[near[-1]], 'state')


def error_text(state: str, error: float) -> str:
    """Returns a clause with the error and the tolerance of a state."""
    kind, unit = ('distance', 'm') if state == MOVE_FORWARD else ('heading error', 'rad')
    return f'a {kind} of {error:.2f} {unit}; {TOLERANCES[state]:g} is the tolerance'


def not_silent(node_run: NodeRun) -> Iterator[BrokenLink]:
    """Checks that commands end, with a zero, when the node is at the goal or has lost control."""
    sent = node_run.commands
    is_moving = (sent.linear != 0.0) | (sent.angular != 0.0)
    # without control, a node may send zeros
    ends = [(begin, end, 'ctrl_relinq became False', is_moving)
            for begin, end, value in control_intervals(node_run)
            if not value and node_run.runs_at(begin)]
    ends += [(part.begin, part.end, 'state became ' + GOAL_REACHED, np.ones(len(sent), bool))
             for part in node_run.cached(state_intervals) if part.state == GOAL_REACHED]
    for begin, end, event, is_wrong in sorted(ends, key=lambda each: each[0]):
        seen = begin + MAX_PROBE_LAG
        if end <= seen:
            continue
        late = np.flatnonzero(is_wrong & (sent.arrival > seen) & (sent.arrival < end))
        if len(late) > 3:
            yield BrokenLink(f'{event}, and {len(late)} commands came later: '
                             + command_text(sent, late[0]), sent.arrival[late[0]])
        last = np.flatnonzero((sent.arrival > begin - 1.0) & (sent.arrival < seen))[-1:]
        if is_moving[last].any():
            yield BrokenLink(f'{event}, and the last command was {command_text(sent, last[0])}: '
                             'no zero followed', begin)


def command_text(sent: Any, k: int) -> str:
    return f'linear.x {sent.linear[k]:.2f}, angular.z {sent.angular[k]:.2f}'


def too_seldom(node_run: NodeRun) -> Iterator[BrokenLink]:
    """Checks that the commands of a state come often enough."""
    for part in node_run.cached(state_intervals):
        if len(part.commands) > 3 and part.state in TOLERANCES:
            yield from slow_commands(part.commands.arrival, part.begin)
