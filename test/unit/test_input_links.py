"""What a node does with a gamepad or a mouse, and what it prints: closed forms, no ROS."""
import json
import math

import numpy as np
import pytest
from made_run import made

from tb3_labs.report.run_data import MouseSamples, Numbers, Orientations, PadSamples, States, Twists, Variables
from tb3_labs.watch.broken_link import NodeRun
from tb3_labs.watch.chains import CHAINS, first_broken

#: Messages of a device come every EVERY [s]; a node answers within ANSWER [s].
EVERY, ANSWER = 0.05, 0.004
#: A stimulus lasts one second: (name, axes, button).
PLAYED = (('left stick up', {1: 1.0}, None), ('left stick down', {1: -1.0}, None),
          ('right stick left', {3: 1.0}, None), ('both', {1: 0.5, 3: -0.5}, None),
          ('sticks let go', {}, None), ('other', {0: 1.0}, None), ('other', {2: 1.0}, None),
          ('A', {}, 0), ('left stick up after A', {1: 1.0}, None), ('', {}, None), ('B', {}, 1),
          ('left stick up after B', {1: 1.0}, None), ('', {}, None), ('Y', {}, 2), ('', {}, None))


def samples(kind, rows):
    """Samples of these rows; of each, its time is the first column."""
    columns = [np.array(column, dtype=object if isinstance(column[0], str) else None) for column in zip(*rows)]
    return kind(columns[0], *columns) if rows else kind.none()


def right(axes, buttons, node):
    """A right node, by its handout: the command, or None."""
    if buttons[0] or buttons[1]:
        node.update(mine=bool(buttons[1]), said=not buttons[1])
    node['call'] = bool(buttons[2])
    return (0.22 * axes[1], 2.84 * axes[3]) if node['mine'] else None


def pad_run(react=right, played=PLAYED):
    """The run of a node: ``react(axes, buttons, what it keeps)`` gives linear.x and angular.z."""
    heard, sent, control, own, calls = [], [], [], [], [(0.0, '{"kind": "trial"}')]
    node = {'mine': True}
    for k, (_, moved, button) in enumerate(played):
        for at in np.arange(k, k + 1.0 - 1e-9, EVERY):
            axes, buttons = np.zeros(PadSamples.AXES), np.zeros(PadSamples.BUTTONS)
            axes[list(moved)] = list(moved.values())
            if button is not None and at < k + 0.15:
                buttons[button] = 1.0
            heard.append((at, axes, buttons))
            command = react(axes, buttons, node)
            sent += [(at + ANSWER, *command, 0.0, 0.0, 0.0, 0.0)] if command is not None else []
            control += [(at + ANSWER, float(node.pop('said')))] if 'said' in node else []
            calls += [(at + ANSWER, '{"kind": "call"}')] if node.pop('call', False) else []
            own += [(at + 0.03, 'gamepad', 'has_control' if name == 'mine' else name, str(value))
                    for name, value in node.items()]
    return NodeRun(made(
        duration=float(len(played)), pad=samples(PadSamples, heard), commands=samples(Twists, sent),
        control=samples(Numbers, control), events=samples(States, calls[:2]), variables=samples(Variables, own),
        states=samples(States, [(float(k), name) for k, (name, _, _) in enumerate(played)])))


def told(node_run, lab='gamepad', weak=True):
    found = first_broken(node_run, CHAINS[lab], ['mouse'] if lab == 'turn' else None, weak)
    return found and found[1].message


def test_a_run_without_a_device_breaks_no_link():
    sent = Twists(*(np.arange(30.0) for _ in range(8)))
    for links in 'gamepad', 'turn', 'imu':
        assert told(NodeRun(made(commands=sent)), links) is None


def test_of_a_pad_that_is_not_known_another_axis_is_weak():
    node_run = pad_run(driving(lambda axes: (0.22 * axes[0], 2.84 * axes[2])), [('', *each[1:]) for each in PLAYED])
    assert told(node_run, weak=False) is None and 'linear.x follows 0.22 times axis 0' in told(node_run)


def driving(command):
    """A node with right buttons whose sticks give ``command(axes)``."""
    return lambda axes, buttons, node: command(axes) if right(axes, buttons, node) else None


def waits(axes, buttons, node):
    """Its callback waited: four zeros come 0.7 s after the stick's push."""
    node['steps'] = node.get('steps', 0) + 1
    command = right(axes, buttons, node)
    return (0.0, 0.0) if command and 11.7 < node['steps'] / 20.0 <= 11.9 else command


def smooth(axes, buttons, node):
    node['smooth_x'] = 0.9 * node.get('smooth_x', 0.0) + 0.1 * axes[1]
    return (0.22 * node['smooth_x'], 2.84 * axes[3]) if right(axes, buttons, node) else None


def pressing(*numbers):
    """A node that takes these buttons for A, B and Y."""
    return lambda axes, buttons, node: right(axes, buttons[list(numbers)], node)


def drives_on(axes, buttons, node):
    right(axes, buttons, node)
    return 0.22 * axes[1], 2.84 * axes[3]


def forgets_b(axes, buttons, node):
    return right(axes, np.array([buttons[0], 0.0, *buttons[2:]]), node) or (
        node.update(said=False) if buttons[1] else None)


@pytest.mark.parametrize('react, said, is_weak', [
    (right, None, True), (waits, None, True),
    (driving(lambda axes: (0.22 * axes[3], 2.84 * axes[1])),
     'linear.x follows 0.22 times axis 3; it should be 0.22 times axis 1', False),
    (driving(lambda axes: (0.22 * axes[1], -2.84 * axes[3])), 'angular.z follows -2.84 times axis 3', False),
    (driving(lambda axes: (axes[1], 2.84 * axes[3])), 'linear.x follows 1 times axis 1', False),
    (driving(lambda axes: (0.2 * axes[1], 2.84 * axes[3])), 'linear.x follows 0.2 times axis 1', True),
    (driving(lambda axes: (0.22 * axes[1], 2.84 * axes[3] ** 3)), 'angular.z was -0.35', True),
    (driving(lambda axes: (0.0, 2.84 * axes[3])), 'linear.x was 0 in 20 of 20 commands with axis 1 at 1', False),
    (driving(lambda axes: (0.22 * axes[1], 0.0 if axes[1] else 2.84 * axes[3])),
     'angular.z was 0 in 10 of 10 commands with axis 1 at 0.5 and axis 3 at -0.5', False),
    (driving(lambda axes: (0.22 * axes[1], 2.84 * axes[3]) if axes.any() else None),
     'no zero velocity followed with all inputs at 0: 0 commands came in 0.5 s', False),
    (driving(lambda axes: None), 'with axis 1 at 1 nothing came on cmd_vel for 1.0 s', False),
    (smooth, 'linear.x follows 0.22 times smooth_x; it should be 0.22 times axis 1', False),
    (pressing(1, 0, 2), 'after A ctrl_relinq said False, 50 commands came, and 0 resets were called', False),
    (pressing(0, 1, 5), 'after Y ctrl_relinq said nothing, 30 commands came, and 0 resets', False),
    (pressing(0, 1, 1), 'after B ctrl_relinq said False, 50 commands came, and 1 resets were called', False),
    (drives_on, 'after A ctrl_relinq said True, 50 commands came, ', False),
    (forgets_b, 'with axis 1 at 1 nothing came on cmd_vel for 1.0 s; has_control was False', False)])
def test_the_first_link_of_a_pad_that_breaks_is_named(react, said, is_weak):
    """It is weak if the robot moves to the right side, and not faster."""
    node_run = pad_run(react)
    found = told(node_run)
    assert found is None if said is None else said in found
    assert (told(node_run, weak=False) is None) == is_weak


def test_the_axes_are_those_of_the_pad_that_was_played():
    played = [('left stick up', {1: 1.0}, None), ('right stick left', {2: 1.0}, None)]
    assert told(pad_run(driving(lambda axes: (0.22 * axes[1], 2.84 * axes[2])), played)) is None
    assert 'it should be 2.84 times axis 2' in told(pad_run(right, played))


# -- the mouse

def far(value):
    return value if abs(value) > 0.25 else 0.0


def mouse_run(react, up):
    places = ((0.0, 1.0, False), (0.0, 0.0, True), (0.0, 1.0, True), (0.2, -0.2, True), (-1.0, 0.0, True),
              (0.6, -0.6, True), (0.0, 1.0, True), (0.0, 1.0, False))
    heard = [(at, *place) for k, place in enumerate(places) for at in np.arange(k, k + 1.0 - 1e-9, EVERY)]
    sent = [(at + ANSWER, *command, 0.0, 0.0, 0.0, 0.0) for at, *place in heard
            for command in [react(*place)] if command is not None]
    return NodeRun(made(
        duration=8.0, mouse=samples(MouseSamples, heard), commands=samples(Twists, sent),
        events=samples(States, [(0.0, json.dumps({'kind': 'mouse client', 'up': up}))])))


@pytest.mark.parametrize('react, up, said', [
    (lambda x, y, on: (on * 0.5 * far(y), on * -0.5 * far(x)), 1, None),
    (lambda x, y, on: (on * 0.5 * far(y), on * 0.5 * far(x)), 1, 'angular.z follows 0.5 times x'),
    (lambda x, y, on: (on * 0.5 * x * bool(far(y)), on * -0.5 * y * bool(far(x))), 1,
     'linear.x follows 0.5 times x outside of both dead zones; it should be 0.5 times y'),
    (lambda x, y, on: (on * 0.5 * y, on * -0.5 * x), 1, 'linear.x follows 0.5 times y; it should'),
    (lambda x, y, on: (0.5 * far(y), -0.5 * far(x)), 1,
     'linear.x follows 0.5 times y outside of the dead zone, also while it is not active'),
    (lambda x, y, on: (0.5 * far(y), -0.5 * far(x)) if on else None, 1,
     'no zero velocity followed with mouse y at 1 and mouse inactive at 1: 0 commands'),
    (lambda x, y, on: (on * 0.4 * far(y), on * -0.5 * far(x)), 1, 'linear.x follows 0.4 times y'),
    (lambda x, y, on: (on * -0.5 * far(y), on * -0.5 * far(x)), 1, 'linear.x follows -0.5 times y'),
    (lambda x, y, on: (on * -0.5 * far(y), on * -0.5 * far(x)), 0, None),
    (lambda x, y, on: (on * -0.5 * y, on * -0.5 * far(x)), 0, '-0.5 times y; it should be -0.5 times y outside'),
    (lambda x, y, on: (on * 0.5 * far(y), on * -0.5 * far(x)), -1, None),
    (lambda x, y, on: (on * -0.5 * far(y), on * -0.5 * far(x)), -1, 'linear.x follows -0.5 times y')])
def test_the_mistake_of_a_mouse_is_named(react, up, said):
    """The y of a client that is not known may count down."""
    found = told(mouse_run(react, up), 'turn')
    assert found is None if said is None else said in found


# -- the IMU exercise

def printed_run(number, late=0):
    """A node that prints ``number(yaw [deg], roll [deg], ...)`` of a robot that turns twice."""
    time = np.arange(0.0, 12.0, 0.01)
    yaw = (60.0 * time + 40.0 * np.sin(time) + 180.0 + 37.0) % 360.0 - 180.0
    y, r, roll = np.radians(yaw) / 2.0, np.radians(2.5 * np.sin(time)), 5.0 * np.sin(time)
    quaternion = np.cos(y) * np.cos(r), np.cos(y) * np.sin(r), np.sin(y) * np.sin(r), np.sin(y) * np.cos(r)
    imu = Orientations(time, time, np.radians(yaw), 0.0 * time, *quaternion)
    lines = [(time[k] + 0.002, 'Current heading is {:f} degrees.\n'.format(
        number(yaw[k - late], roll[k - late]))) for k in range(late, len(time), 10)]
    return NodeRun(made(duration=12.0, imu=imu, printed=samples(States, lines)))


@pytest.mark.parametrize('number, late, said', [
    (lambda yaw, roll: yaw % 360.0, 0, None),
    (lambda yaw, roll: yaw, 0, 'follows the yaw in degrees, from -180 to 180; it should be the heading'),
    (lambda yaw, roll: math.radians(yaw), 0, 'follows the yaw in radians'),
    (lambda yaw, roll: roll, 0, 'follows the roll in degrees'),
    (lambda yaw, roll: abs(yaw), 0, 'follows the yaw in degrees, without its sign'),
    (lambda yaw, roll: (yaw - 37.0) % 360.0, 0, 'follows the heading -37.0 degrees, which was 37.0 at'),
    (lambda yaw, roll: yaw % 360.0, 150, 'follows the heading, from 0 to 360 degrees, up to 1.5 s late'),
    (lambda yaw, roll: 12.0, 0, 'the printed number stays at 12.000000')])
def test_the_quantity_that_is_printed_is_named(number, late, said):
    found = told(printed_run(number, late), 'imu')
    assert found is None if said is None else said in found
