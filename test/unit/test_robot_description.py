"""The URDF for RViz against the robots' numbers."""
from xml.etree import ElementTree

import pytest

from tb3_labs.robot.turtlebot3 import MODELS, WHEEL_JOINTS
from tb3_labs.ros.robot_description import main

LINKS = {'base_footprint', 'base_link', 'wheel_left_link', 'wheel_right_link'}


def described(capsys, *words):
    assert main(*words) == 0
    return ElementTree.fromstring(capsys.readouterr().out)


def numbers(element, attribute):
    return [float(word) for word in element.get(attribute).split()]


@pytest.mark.parametrize('model', MODELS.values())
def test_the_wheels_are_where_the_robot_has_them(capsys, model):
    robot = described(capsys, model.name)
    joints = {joint.get('name'): joint for joint in robot.findall('joint')}
    assert {link.get('name') for link in robot.findall('link')} == LINKS
    for name, side in zip(WHEEL_JOINTS, (1.0, -1.0)):
        assert numbers(joints[name].find('axis'), 'xyz') == [0.0, 1.0, 0.0]      # forward is positive
        x, y, _ = numbers(joints[name].find('origin'), 'xyz')
        assert (x, y) == (0.0, side * model.wheel_separation / 2.0)
    radii = [float(shape.get('radius')) for shape in robot.iter('cylinder')]
    assert sorted(radii) == [model.wheel_radius, model.wheel_radius, model.body_radius]


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
