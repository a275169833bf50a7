"""The commands and the output of a node with a gamepad or a mouse: closed forms, no ROS."""
import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some
from made_run import made, values

from tb3_labs.report.run_data import MouseSamples, Orientations, PadSamples, States, Twists, Variables
from tb3_labs.watch.chain import Inside, first_broken
from tb3_labs.watch.labs import CHAINS

#: Messages of a device come every EVERY [s]; a node answers within ANSWER [s].
EVERY, ANSWER = 0.05, 0.004
#: A stimulus lasts one second: (name, axes, button).
PLAYED = (('left stick up', {1: 1.0}, None), ('left stick down', {1: -1.0}, None),
          ('right stick left', {3: 1.0}, None), ('both', {1: 0.5, 3: -0.5}, None),
          ('sticks let go', {}, None), ('other', {0: 1.0}, None), ('other', {2: 1.0}, None),
          ('A', {}, 0), ('left stick up after A', {1: 1.0}, None), ('', {}, None), ('B', {}, 1),
          ('left stick up after B', {1: 1.0}, None), ('', {}, None), ('Y', {}, 2), ('', {}, None))
REQUEST = 'pose: \n  pose: \n    pose: \n      position: \n        x: {}\n        y: 0.0\n' \
    '        z: 0.0\n      orientation: \n        x: 0.0\n        y: 0.0\n        z: 0.0\n' \
    '        w: {}\n    covariance: [{}, 0.0]\n'


def samples(kind, rows):
    columns = list(map(np.array, zip(*rows))) if rows else None
    return kind(columns[0], *columns) if rows else kind.none()


def words(kind, rows):
    at, said = zip(*rows)
    return kind(np.array(at), np.array(at), np.array(said, dtype=object))


def right(axes, buttons, node):
    """A right node, by its handout: the command, or None."""
    if buttons[0] or buttons[1]:
        node.update(mine=bool(buttons[1]), said=not buttons[1])
    if buttons[2]:
        node['call'] = {'service': 'set_pose', 'request': REQUEST.format(0.0, 1.0, 0.1)}
    return (0.22 * axes[1], 2.84 * axes[3]) if node['mine'] else None


def pad_run(react=right, played=PLAYED):
    """The run of a node: ``react(axes, buttons, what it keeps)`` gives linear.x, angular.z and
    linear.y."""
    heard, sent, control, own, calls = [], [], [], [], []
    node = {'mine': True}
    for k, (_, moved, button) in enumerate(played):
        for at in np.arange(k, k + 1.0 - 1e-9, EVERY):
            axes, buttons = np.zeros(PadSamples.AXES), np.zeros(PadSamples.BUTTONS)
            for axis, value in moved.items():
                axes[axis] = value
            if button is not None and at < k + 0.15:
                buttons[button] = 1.0
            heard.append((at, axes, buttons))
            command = react(axes, buttons, node)
            if command is not None:
                sent.append((at + ANSWER, *command, *(6 - len(command)) * [0.0]))
            if 'said' in node:
                control.append((at + ANSWER, float(node.pop('said'))))
            if 'call' in node:
                calls.append((at + ANSWER, json.dumps(dict(node.pop('call'), kind='call'))))
            own += [(at + 0.03, 'gamepad', 'has_control' if name == 'mine' else name, str(value))
                    for name, value in node.items()]
    return Inside(made(
        duration=float(len(played)), pad=samples(PadSamples, heard), commands=samples(Twists, sent),
        control=values(*zip(*control)) if control else values([], []),
        events=words(States, calls[:1] or [(0.0, '{"kind": "trial"}')]),
        states=words(States, [(float(k), name) for k, (name, _, _) in enumerate(played)]),
        variables=variables_of(own)))


def variables_of(rows):
    at, node, name, value = (np.array(column, dtype=object) for column in zip(*rows))
    return Variables(at.astype(float), at.astype(float), node, name, value)


def told(inside, lab='gamepad', weak=True):
    found = first_broken(inside, CHAINS[lab], weak=weak)
    found = found and found[1]
    return found and found.words


def test_a_right_node_is_not_accused():
    assert told(pad_run()) is None


def test_a_wait_in_the_middle_and_the_zeros_of_an_end_are_told_apart():
    """Y without a service; then Ctrl+C while the stick is up."""
    def react(axes, buttons, node):
        node['y'] = node.get('y', False) or bool(buttons[2])
        return right(axes, buttons, node) if not node['y'] else None
    played = [*PLAYED, ('stick', {1: 1.0}, None)]
    assert told(pad_run(react, played)) == \
        'with axis 1 at 1 nothing came on cmd_vel for 1.0 s; the last button was button 2 (Y)'

    def ends(axes, buttons, node):
        node['steps'] = node.get('steps', 0) + 1
        return (0.0, 0.0) if node['steps'] > 20 * len(PLAYED) + 20 else right(axes, buttons, node)
    played = [*PLAYED, ('stick', {1: 1.0}, None), ('Ctrl+C', {1: 1.0}, None)]
    assert told(pad_run(ends, played)) is None


def test_a_run_without_a_device_breaks_no_link():
    sent = Twists(*(np.arange(30.0) for _ in range(8)))
    for links in 'gamepad', 'turn', 'imu':
        assert told(Inside(made(commands=sent)), links) is None


def test_of_a_pad_that_is_not_known_another_axis_is_weak():
    def react(axes, buttons, node):
        return right(np.array([0.0, axes[0], 0.0, axes[2]]), buttons, node)
    inside = pad_run(react, [('', moved, button) for _, moved, button in PLAYED])
    assert told(inside, weak=False) is None and 'linear.x follows 0.22 times axis 0' in told(inside)


def test_a_callback_that_waited_answers_a_few_messages_late():
    """After Y it waited for a service: four zeros come while the stick is up, 0.8 s after its push."""
    def react(axes, buttons, node):
        node['steps'] = node.get('steps', 0) + 1
        command = right(axes, buttons, node)
        return (0.0, 0.0) if 20 * len(PLAYED) + 16 < node['steps'] <= 20 * len(PLAYED) + 20 else command
    assert told(pad_run(react, [*PLAYED, ('stick', {1: 1.0}, None), ('', {1: 1.0}, None)])) is None


@pytest.mark.parametrize('command, said', [
    (lambda axes: (0.22 * axes[3], 2.84 * axes[1]),
     'linear.x follows 0.22 times axis 3; it should be 0.22 times axis 1'),
    (lambda axes: (0.22 * axes[1], -2.84 * axes[3]),
     'angular.z is -2.84 times axis 3, the handout has +2.84'),
    (lambda axes: (axes[1], 2.84 * axes[3]), 'linear.x is 1 times axis 1, the handout has +0.22'),
    (lambda axes: (0.22 * axes[1], 2.84 * axes[2]), 'angular.z follows 2.84 times axis 2'),
    (lambda axes: (0.0, 2.84 * axes[3], 0.22 * axes[1]),
     'linear.x stayed 0, also with axis 1 at 1; it should be 0.22 times axis 1; linear.y was 0.22'),
    (lambda axes: (0.22 * axes[1], 0.0 if axes[1] else 2.84 * axes[3]),
     'with axis 1 at 0.5 and axis 3 at -0.5 for 0.5 s angular.z was 0, it should be 2.84 times axis 3: '
     '-1.4; with axis 3 at 1 it was right'),
    (lambda axes: (0.22 * axes[1], 2.84 * axes[3]) if axes.any() else None,
     'no zero velocity followed when the sticks were let go: no command came'),
    (lambda axes: None, 'with axis 1 at 1 nothing came on cmd_vel for 1.0 s')])
def test_the_field_that_follows_another_input_is_named(command, said):
    def react(axes, buttons, node):
        return command(axes) if right(axes, buttons, node) else None
    assert said in told(pad_run(react), weak=False)


def test_the_own_variable_that_a_field_follows_is_named():
    def react(axes, buttons, node):
        node['smooth_x'] = 0.9 * node.get('smooth_x', 0.0) + 0.1 * axes[1]
        return (0.22 * node['smooth_x'], 2.84 * axes[3]) if right(axes, buttons, node) else None
    assert told(pad_run(react)).endswith('; it follows 0.22 times smooth_x')


@pytest.mark.parametrize('command, said', [
    (lambda axes: (0.2 * axes[1], 2.84 * axes[3]), 'linear.x is 0.2 times axis 1'),
    (lambda axes: (0.22 * axes[1], 2.84 * axes[3] ** 3), 'angular.z was -0.35')])
def test_another_law_is_weak(command, said):
    def react(axes, buttons, node):
        return command(axes) if right(axes, buttons, node) else None
    inside = pad_run(react)
    assert told(inside, weak=False) is None and said in told(inside)


def changed(**keys):
    """A node whose state differs from the right one's after its reaction."""
    def react(axes, buttons, node):
        command = right(axes, buttons, node)
        for name, change in keys.items():
            if name in node:
                node[name] = change(node[name])
        return command
    return react


def call_of(**parts):
    return changed(call=lambda call: dict(call, **parts))


def forgets_b(axes, buttons, node):
    command = right(axes, buttons, node)
    node['mine'] = node['mine'] and not node.setdefault('once', False)
    node['once'] = node['once'] or not node['mine']
    return command if node['mine'] else None


@pytest.mark.parametrize('react, said', [
    (changed(said=lambda value: not value), 'ctrl_relinq said False after button 0 (A)'),
    (changed(mine=lambda value: True), 'has_control stayed True after button 0 (A): '),
    (forgets_b, 'with axis 1 at 1 nothing came on cmd_vel for 1.0 s; the last button was button 1 (B), '
     'and has_control stayed False'),
    (call_of(service='setpose'), 'it called setpose, the handout has set_pose'),
    (call_of(request=REQUEST.format(1.0, 1.0, 0.1)), 'the position 1, 0, 0; it should be 0, 0, 0'),
    (call_of(request=REQUEST.format(0.0, 0.0, 0.1)), 'w 0, of length 0; it should be 0, 0, 0, 1'),
    (call_of(request=REQUEST.format(0.0, 1.0, 0.0)), 'the covariance in the request of the reset is')])
def test_the_button_that_is_not_obeyed_is_named(react, said):
    assert said in told(pad_run(react))


def test_a_call_after_another_button_is_told():
    def react(axes, buttons, node):
        return right(axes, np.array([*buttons[:2], buttons[1], *buttons[3:]]), node)
    assert told(pad_run(react)) == \
        'no reset was called after button 2 (Y); one was called after button 1 (B)'


def test_the_numbers_are_those_of_the_pad_that_was_played():
    played = [(name, {2 if axis == 3 else axis: value for axis, value in moved.items()}, button)
              for name, moved, button in PLAYED if name != 'other']

    def react(axes, buttons, node):
        return right(np.array([0.0, axes[1], 0.0, axes[2]]), buttons, node)
    assert told(pad_run(react, played)) is None
    assert 'it should be 2.84 times axis 2' in told(pad_run(right, played))


@given(some.lists(some.tuples(some.sampled_from([-1.0, -0.5, 0.0, 0.25, 1.0]), some.sampled_from([-1.0, 0.0, 0.7])),
                  min_size=4, max_size=8), some.sampled_from([1, 3]), some.floats(0.05, 3.0))
def test_a_field_is_named_by_the_axis_that_it_follows(places, axis, factor):
    """For any motion: by it, or by one that is equal on this motion."""
    played = [PLAYED[0]] + [('', {1: forward, 3: left}, None) for forward, left in places]
    run = pad_run(lambda axes, *_: (factor * axes[axis], 2.84 * axes[3]), played)
    said, axes = told(run) or '', run.run.pad.axes
    if axis == 1:
        assert ('linear.x' in said) == (abs(factor / 0.22 - 1.0) >= 0.02)
        assert 'follows' not in said
    elif 'follows' in said:
        assert 'linear.x follows {:.3g} times axis 3;'.format(factor) in said
    elif said.startswith('linear.x is'):      # the axes are equal but for their scale
        assert np.linalg.matrix_rank(axes) == 1
    else:
        assert 'linear.x stayed 0' in said and not axes[:, 3].any() or 'linear.x was' in said


# -- the mouse

PLACES = ((0.0, 1.0, False), (0.0, 0.0, True), (0.0, 1.0, True), (0.2, -0.2, True), (-1.0, 0.0, True),
          (0.6, -0.6, True), (0.0, 1.0, True), (0.0, 1.0, False))


def far(value):
    return value if abs(value) > 0.25 else 0.0


def mouse_run(react, up=1):
    heard, sent = [], []
    for k, (x, y, active) in enumerate(PLACES):
        for at in np.arange(k, k + 1.0 - 1e-9, EVERY):
            heard.append((at, x, y, float(active)))
            command = react(x, y, active)
            if command is not None:
                sent.append((at + ANSWER, *command, 0.0, 0.0, 0.0, 0.0))
    return Inside(made(duration=8.0, mouse=samples(MouseSamples, heard),
                       commands=samples(Twists, sent),
                       events=words(States, [(0.0, json.dumps({'kind': 'mouse client', 'up': up}))])))


@pytest.mark.parametrize('react, said', [
    (lambda x, y, on: (on * 0.5 * far(y), on * -0.5 * far(x)), None),
    (lambda x, y, on: (on * 0.5 * far(y), on * 0.5 * far(x)), 'angular.z is 0.5 times x'),
    (lambda x, y, on: (on * -0.5 * far(x), on * 0.5 * far(y)),
     'linear.x follows -0.5 times x outside of the dead zone; it should be 0.5 times y'),
    (lambda x, y, on: (on * 0.5 * y, on * -0.5 * x), 'linear.x follows 0.5 times y; it should'),
    (lambda x, y, on: (0.5 * far(y), -0.5 * far(x)), 'linear.x follows 0.5 times y outside of the dead '
     'zone, also while it is not active'),
    (lambda x, y, on: (0.5 * far(y), -0.5 * far(x)) if on else None,
     'no zero velocity followed with the mouse at (0, 1), not active: no command came'),
    (lambda x, y, on: (on * 0.4 * far(y), on * -0.5 * far(x)), 'linear.x is 0.4 times y')])
def test_the_mistake_of_a_mouse_is_named(react, said):
    found = told(mouse_run(react), 'turn')
    assert found is None if said is None else said in found


@pytest.mark.parametrize('up, said', [(0, None), (1, 'linear.x is -0.5 times y'), (-1, 'linear.x is -0.5')])
def test_a_mouse_client_that_is_not_known_may_count_down(up, said):
    found = told(mouse_run(lambda x, y, on: (on * -0.5 * far(y), on * -0.5 * far(x)), up), 'turn')
    assert found is None if said is None else said in found


@pytest.mark.parametrize('ends, zeros, said', [
    (3.0, (), None), (3.0, np.arange(0.02, 4.0, 0.05), 'commands while turning was True were those of the ')])
def test_commands_of_the_mouse_in_a_turn_are_told(ends, zeros, said):
    """The turn is commanded from 1.0 s to 3.0 s; turning is True until `ends`; the mouse is in its middle."""
    sent = sorted([(at, 0.0, 1.5) for at in np.arange(1.0, 3.0, 0.1)] + [(at, 0.0, 0.0) for at in zeros])
    own = [(at, 'controller', 'turning', str(1.0 <= at < ends)) for at in np.arange(0.0, 4.0, EVERY)]
    found = told(Inside(made(
        duration=4.0, commands=samples(Twists, [(*row, 0.0, 0.0, 0.0, 0.0) for row in sent]),
        mouse=samples(MouseSamples, [(at, 0.0, 0.0, 1.0) for at in np.arange(0.0, 4.0, EVERY)]),
        variables=variables_of(own))), 'turn')
    assert found is None if said is None else said in found


def test_a_number_named_turning_is_no_flag():
    """The commands after a letter do not come from the mouse."""
    run = mouse_run(lambda x, y, on: (on * 0.5 * far(y), on * -0.5 * far(x))).run
    later = [(at, 0.0, 1.5, 0.0, 0.0, 0.0, 0.0) for at in np.arange(6.0, 8.0, 0.02)]
    own = [(at, 'controller', 'TURNING', '2') for at in np.arange(0.0, 8.0, EVERY)]
    assert told(Inside(replace(
        run, commands=Twists.joined([run.commands.between(0.0, 6.0), samples(Twists, later)]),
        variables=variables_of(own), states=words(States, [(5.99, 'l beside the mouse')]))), 'turn') is None


# -- the IMU exercise

def printed_run(number, late=0):
    """A node that prints ``number(yaw [deg], roll [deg], ...)`` of a robot that turns twice."""
    time = np.arange(0.0, 12.0, 0.01)
    yaw = (60.0 * time + 40.0 * np.sin(time) + 180.0 + 37.0) % 360.0 - 180.0
    roll = 5.0 * np.sin(time)
    y, r = np.radians(yaw) / 2.0, np.radians(roll) / 2.0
    quaternion = np.cos(y) * np.cos(r), np.cos(y) * np.sin(r), np.sin(y) * np.sin(r), np.sin(y) * np.cos(r)
    imu = Orientations(time, time, np.radians(yaw), 0.0 * time, *quaternion)
    lines = [(time[k] + 0.002, 'Current heading is {:f} degrees.\n'.format(
        number(yaw[k - late], roll[k - late]))) for k in range(late, len(time), 10)]
    return Inside(made(duration=12.0, imu=imu, printed=words(States, lines)))


@pytest.mark.parametrize('number, late, said', [
    (lambda yaw, roll: yaw % 360.0, 0, None),
    (lambda yaw, roll: yaw, 0, 'follows the yaw in degrees, from -180 to 180; it should be the heading'),
    (lambda yaw, roll: math.radians(yaw), 0, 'follows the yaw in radians'),
    (lambda yaw, roll: roll, 0, 'follows the roll in degrees'),
    (lambda yaw, roll: abs(yaw), 0, 'follows the yaw in degrees, without its sign'),
    (lambda yaw, roll: (yaw - 37.0) % 360.0, 0, 'follows the yaw minus 37.0 degrees'),
    (lambda yaw, roll: yaw % 360.0, 150, 'follows the heading, from 0 to 360 degrees, up to 1.5 s late'),
    (lambda yaw, roll: 12.0, 0, 'the printed number stays at 12.000000')])
def test_the_quantity_that_is_printed_is_named(number, late, said):
    found = told(printed_run(number, late), 'imu')
    assert found is None if said is None else said in found
