"""The first mistake of a turn, and what a variable follows: nodes of closed form, no ROS."""
import math
from dataclasses import replace

import numpy as np
import pytest
from made_run import made, speeds_sent, values

from tb3_labs.recording.run_data import Commands, ImuSamples, MouseSamples, Variables
from tb3_labs.watch.headings import heading_candidates, is_usable_heading
from tb3_labs.watch.lab_mistakes import CHECKS
from tb3_labs.watch.mistake import NodeRun, find_first_mistake
from tb3_labs.watch.variables import Quantity, Series, longest_delay, matching_quantities

#: A letter every EVERY [s], and the time between two steps of robot and IMU [s]; a node's callback and a
#: reading of its variables come every so many steps.
EVERY, TICK, CALLBACK, READING = 6.0, 0.01, 10, 5
LETTERS = 'lrrllr'


class HandoutNode:
    """The handout's node; a wrong one has another method."""

    def __init__(self):
        self.curr_yaw, self.goal_yaw, self.turning, self.ang_z = 40.0, 0.0, False, None

    def heading(self, yaw):
        return yaw + 360.0 if yaw < 0.0 else yaw

    def goal(self, letter):
        return (self.curr_yaw + (90.0 if letter == 'l' else -90.0)) % 360.0

    def error(self):
        error = self.goal_yaw - self.curr_yaw
        return error - 360.0 if error > 180.0 else error + 360.0 if error < -180.0 else error

    def command(self, error):
        return max(-1.5, min(1.5, 0.1 * error))

    def is_over(self, error):
        return abs(error) < 10.0

    def imu(self, yaw):
        self.curr_yaw = self.heading(yaw)

    def letter(self, letter):
        self.goal_yaw = self.goal(letter)
        self.turning = True

    def control(self):
        """The angular.z of a command; None if the node sends no command."""
        if not self.turning:
            return None
        error = self.error()
        self.turning = not self.is_over(error)
        return self.command(error) if self.turning else 0.0


def played(node):
    """The run of a node: a robot without delays, which is typed LETTERS."""
    yaw, speed = math.radians(40.0), 0.0
    turned, commands, rows = [], [], []
    for k in range(int(EVERY * (len(LETTERS) + 0.5) / TICK)):
        at = k * TICK
        yaw += speed * TICK
        wrapped = math.remainder(yaw, math.tau)
        turned.append((at, wrapped, speed))
        node.imu(math.degrees(wrapped))
        if k % int(EVERY / TICK) == int(1.0 / TICK) and k // int(EVERY / TICK) < len(LETTERS):
            node.letter(LETTERS[k // int(EVERY / TICK)])
        if k % CALLBACK == 5:
            command = node.control()
            if command is not None:
                speed = command
                commands.append((at + 1e-3, command))
        if k % READING == 0:
            rows += [(at + 2e-3, '/controller', name, str(vars(node)[name]))
                     for name in ('curr_yaw', 'goal_yaw', 'turning')]
    at, yaws, rates = map(np.array, zip(*turned))
    sent, speeds = map(np.array, zip(*commands)) if commands else (np.empty(0), np.empty(0))
    when, *words = (np.array(each, dtype=object) for each in zip(*rows))
    nothing, half = 0.0 * at, yaws / 2.0
    letters = [1.0 + EVERY * k for k in range(len(LETTERS))]
    return made(
        duration=float(at[-1]), imu=ImuSamples(
            at, at, yaws, rates, np.cos(half), nothing, nothing, np.sin(half)),
        commands=speeds_sent(sent, sent, 0.0 * sent, speeds),
        variables=Variables(when.astype(float), when.astype(float), *words),
        letters=values(letters, [1.0 if each == 'l' else -1.0 for each in LETTERS]), starts=(0.0,))


def untyped(run):
    """The run as in a recording without letters."""
    return replace(run, letters=values([], []), starts=())


def with_commands(run, times, angular=0.0, begin=0.0, end=0.0):
    """The run with more commands, and without its own from `begin` to `end`."""
    sent, nothing = run.commands, 0.0 * times
    sent = sent.take((sent.arrival < begin) | (sent.arrival > end))
    both = Commands.joined([sent, speeds_sent(times, times, nothing, nothing + angular)])
    return replace(run, commands=both.take(np.argsort(both.arrival)))


def told(run):
    """The sentence on the first mistake; '' if there is none."""
    found = find_first_mistake(NodeRun(run), CHECKS['turn'])
    return '' if found is None else found.as_sentence({'goal_yaw': [7, 9]})


def node_with(**methods):
    """A node with these methods in place of the handout's."""
    node = type('Node', (HandoutNode,), methods)()
    node.curr_yaw = node.heading(40.0)
    return node


RIGHT = {
    'as in the handout': {},
    'over whole turns': {
        'heading': lambda self, yaw: self.curr_yaw + math.remainder(yaw - self.curr_yaw, 360.0),
        'goal': lambda self, letter: self.curr_yaw + (90.0 if letter == 'l' else -90.0)},
    'from the heading at its start': {'heading': lambda self, yaw: (yaw - 40.0) % 360.0},
    'in radians': {
        'heading': lambda self, yaw: math.radians(yaw),
        'goal': lambda self, letter: self.curr_yaw + math.radians(90.0 if letter == 'l' else -90.0),
        'error': lambda self: math.degrees(math.remainder(self.goal_yaw - self.curr_yaw, math.tau))}}


@pytest.mark.parametrize('name', RIGHT)
def test_a_right_node_in_any_range_or_unit_is_not_accused(name):
    assert told(played(node_with(**RIGHT[name]))) == ''


@pytest.mark.parametrize('is_typed', [True, False])
def test_a_finer_tolerance_is_no_mistake(is_typed):
    """The node slows down, and ends within half a degree."""
    run = played(node_with(command=lambda self, error: max(-1.5, min(1.5, 0.03 * error)),
                           is_over=lambda self, error: abs(error) < 0.5))
    assert find_first_mistake(NodeRun(run if is_typed else untyped(run)), CHECKS['turn']) is None


def heading_of_a_second_ago(self, yaw):
    yaws = vars(self).setdefault('yaws', 100 * [40.0])
    yaws.append(yaw % 360.0)
    return yaws[-101]


WRONG = {
    'heading': [
        (lambda self, yaw: 12.5, 'curr_yaw stays at 12.5; it should be the heading, from 0 to 360'),
        (lambda self, yaw: yaw + 180.0 if yaw < 0.0 else yaw,
         'follows the yaw in degrees, plus 180 where it is negative'),
        (lambda self, yaw: -yaw % 360.0, 'follows the yaw in degrees, mirrored'),
        (lambda self, yaw: math.sin(math.radians(yaw) / 2.0) + (360.0 if yaw < 0.0 else 0.0),
         'follows the z of the quaternion plus 360 where it is negative'),
        (heading_of_a_second_ago, 'from 0 to 360 degrees, up to 1.0 s late; it should be')],
    'goal': [
        (lambda self, letter: self.curr_yaw + 90.0,
         'After r, with curr_yaw 124.6, goal_yaw became 214.6; it should be 34.6; after l with 40 it was'),
        (lambda self, letter: self.goal_yaw, 'after l, with curr_yaw 40, goal_yaw stayed 0; it'),
        (lambda self, letter: self.curr_yaw + math.pi / 2.0, 'goal_yaw became 41.57; it should be 130')],
    'error': [
        (lambda self: self.goal_yaw - self.curr_yaw, 'by the short way'),
        (lambda self: abs(self.goal_yaw - self.curr_yaw) % 360.0,
         'for an error of -90 degrees the command was +1.50 rad/s'),
        (lambda self: self.curr_yaw - self.goal_yaw, 'For an error of +90 degrees the command was -1.50')],
    'command': [
        (lambda self, error: 0.1 * error, 'the command was +9.00 rad/s, at most 1.5'),
        (lambda self, error: 0.0, 'after l, for an error of 90 degrees, angular.z stayed 0'),
        (lambda self, error: 1.5 if error < -15.0 else min(1.5, 0.1 * error),
         'for an error of -90 degrees the command was +1.50 rad/s')],
    'is_over': [
        (lambda self, error: error < 10.0, 'After r, at an error of -90 degrees, turning stayed False'),
        (lambda self, error: abs(error) < 45.0, 'ended at an error of +38'),
        (lambda self, error: abs(error) < 1e-9, 'and the turn after l went on')]}


@pytest.mark.parametrize('method, wrong, words', [
    (method, wrong, words) for method, each in WRONG.items() for wrong, words in each])
def test_the_sentence_on_the_first_broken_link_has_its_numbers(method, wrong, words):
    assert words.lower() in told(played(node_with(**{method: wrong}))).lower()


def test_a_turn_that_ends_at_once_is_named_without_letters():
    """The tolerance has no abs(), and `turning` is True until the next callback."""
    run = played(node_with(is_over=lambda self, error: error < 10.0))
    assert 'After a letter, at an error of -90 degrees, turning stayed False, or was False' in told(untyped(run))


def test_the_sentence_has_the_lines_that_assign_the_variable():
    run = played(node_with(goal=lambda self, letter: 0.0))
    assert told(run).endswith(' (goal_yaw is assigned in lines 7, 9).')


def test_zeros_of_another_callback_are_named():
    run = played(HandoutNode())
    assert 'another callback publishes' in told(with_commands(run, run.commands.arrival + 0.05))


@pytest.mark.parametrize('is_typed', [True, False])
@pytest.mark.parametrize('x, active, accused', [(0.5, 1.0, False), (0.25, 1.0, True), (0.1, 1.0, True),
                                                (0.5, 0.0, True)])
def test_a_command_of_the_mouse_does_not_belong_to_the_turn(is_typed, x, active, accused):
    """From 1.4 s on, in the first turn to the left, the node drives to the right: may it do so by the mouse?"""
    at = np.arange(1.4, 6.5, 0.1)
    run = with_commands(played(HandoutNode()), at, -0.25, 1.4, 7.0)
    run = replace(run, mouse=MouseSamples(at - 0.01, at - 0.01, x + 0.0 * at, 0.0 * at, active + 0.0 * at))
    seen = told(run if is_typed else untyped(run))
    assert ('the command was -0.25' in seen) is accused and bool(seen) is accused


@pytest.mark.parametrize('is_typed', [True, False])
@pytest.mark.parametrize('is_over', [True, False])
def test_a_zero_after_the_end_of_the_node_does_not_belong_to_the_turn(is_typed, is_over):
    """The first turn ends by a zero after 0.4 s. The probe read the variables until then, or also later."""
    run = with_commands(played(HandoutNode()), np.array([1.41]), 0.0, 1.4, 7.0)
    read = run.variables.arrival
    if is_over:
        run = replace(run, variables=run.variables.take((read < 1.405) | (read > 6.5)))
    seen = told(run if is_typed else untyped(run))
    assert ('ended at an error of' in seen) is not is_over and bool(seen) is not is_over


class Queue(HandoutNode):
    """Each letter asks for many turns. The next turn begins in the tick in which a turn ends."""

    todo = ()

    def letter(self, letter):
        self.todo = 9 * [letter]
        super().letter(letter)

    def control(self):
        command = super().control()
        if command == 0.0 and self.todo:
            super().letter(self.todo.pop())
        return command


def test_a_right_node_with_a_queue_is_not_accused():
    run = played(Queue())
    assert len(set(run.commands.angular)) > 5
    assert told(untyped(run)) == ''


TIMES = np.arange(0.0, 12.0, 0.01)


def test_a_value_is_not_late_while_the_sensor_is_silent():
    """In a silence of 3 s the last value stays. Then a late node has this value for 0.7 s too long. A tenth
    of the values may have longer delays."""
    samples = TIMES[(TIMES < 4.0) | (TIMES > 7.0)]
    quantity = Quantity('the time', samples, samples, 1.0)
    read = np.arange(1.0, 11.9, 0.05)
    kept = Series('kept', read, read, samples[np.searchsorted(samples, read, 'right') - 1])
    assert matching_quantities(kept, [quantity]) == [quantity] and longest_delay(kept, quantity) < 0.01
    late = kept.take(read >= 7.0)
    late.value[:14] = samples[samples < 4.0][-1]
    assert matching_quantities(late, [quantity]) == [] and 0.1 < longest_delay(late, quantity) < 0.2


def test_only_headings_are_usable_in_any_range():
    yaw = np.interp(TIMES, (0.0, 6.0, 12.0), (-3.0, 3.0, -6.0))
    quaternion = np.cos(yaw / 2.0), 0.0 * yaw, 0.0 * yaw, np.sin(yaw / 2.0)
    right, *others = heading_candidates(NodeRun(made(imu=ImuSamples(TIMES, TIMES, TIMES, TIMES, *quaternion))))
    usable = [each.name for each in [right, *others] if is_usable_heading(each, right)]
    assert usable[0] == 'the heading, from 0 to 360 degrees'
    assert {'the yaw in degrees, from -180 to 180', 'the yaw in radians, from -180 to 180'} <= set(usable)
    assert not [words for words in usable if 'mirrored' in words or 'plus 180' in words or 'roll' in words]
    assert not is_usable_heading(Quantity('late', TIMES, right.value, 360.0), right)


def test_a_private_variable_of_an_object_is_found_by_its_name():
    rows = Variables(*np.array([[0.0], [0.0]]), *np.array([['node'], ['Controller._curr_yaw'], ['1.5']], dtype=object))
    assert NodeRun(made(variables=rows)).variable('curr_yaw').value.tolist() == [1.5]
