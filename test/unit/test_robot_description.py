"""The URDF for RViz against the robots' numbers."""
import math
from xml.etree import ElementTree

import pytest

from tb3_labs.robot.turtlebot3 import MODELS, WHEEL_JOINTS
from tb3_labs.ros.robot_description import main

LINKS = {'base_footprint', 'base_link', 'wheel_left_link', 'wheel_right_link'}


def described(capsys, *words):
    """The robot that the script prints."""
    assert main(*words) == 0
    return ElementTree.fromstring(capsys.readouterr().out)


def numbers(element, attribute):
    return [float(word) for word in element.get(attribute).split()]


@pytest.mark.parametrize('model', MODELS.values())
def test_the_simple_shape_is_as_large_as_the_robot(capsys, model):
    robot = described(capsys, model.name)
    joints = {joint.get('name'): joint for joint in robot.findall('joint')}
    bodies = {link.get('name'): link for link in robot.findall('link')}
    assert set(bodies) == LINKS and set(joints) == {'base_joint'}.union(WHEEL_JOINTS)
    axle = numbers(joints['base_joint'].find('origin'), 'xyz')
    assert axle[:2] == [0.0, 0.0]
    for name, side in zip(WHEEL_JOINTS, (1.0, -1.0)):
        joint = joints[name]
        assert joint.get('type') == 'continuous'
        assert numbers(joint.find('axis'), 'xyz') == [0.0, 1.0, 0.0]      # forward is positive
        x, y, z = numbers(joint.find('origin'), 'xyz')
        assert (x, y) == (0.0, side * model.wheel_separation / 2.0)
        visual = bodies[joint.find('child').get('link')].find('visual')
        wheel = visual.find('geometry/cylinder')
        assert axle[2] + z == float(wheel.get('radius')) == model.wheel_radius    # on the floor
        assert numbers(visual.find('origin'), 'rpy') == pytest.approx([math.pi / 2.0, 0.0, 0.0])
    disc = bodies['base_link'].find('visual/geometry/cylinder')
    assert float(disc.get('radius')) == model.body_radius


def test_a_robot_in_a_namespace_has_frames_of_its_own(capsys):
    robot = described(capsys, 'burger', 'robot3/')
    named = {link.get('name') for link in robot.findall('link')}
    assert named == {'robot3/' + name for name in LINKS}
    ends = robot.findall('joint/parent') + robot.findall('joint/child')
    assert {end.get('link') for end in ends} == named
    # joint_states has the namespace in its own name
    assert {joint.get('name') for joint in robot.findall('joint')} > set(WHEEL_JOINTS)


def test_an_unknown_model_is_one_line(capsys):
    line = main('vacuum')
    assert capsys.readouterr().out == '' and '\n' not in line
    assert line.startswith("robot_description: model = 'vacuum' is not valid: one of burger, ")
