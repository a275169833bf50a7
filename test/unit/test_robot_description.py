"""The URDF for RViz against the robots' numbers."""
from xml.etree import ElementTree

import pytest

from tb3_labs.robot.turtlebot3 import MODELS
from tb3_labs.ros.robot_description import main

LINKS = {'base_footprint', 'base_link'}


def described(capsys, *words):
    """The robot that the script prints."""
    assert main(*words) == 0
    return ElementTree.fromstring(capsys.readouterr().out)


def numbers(element, attribute):
    return [float(word) for word in element.get(attribute).split()]


@pytest.mark.parametrize('model', MODELS.values())
def test_the_simple_shape_is_as_large_as_the_robot(capsys, model):
    robot = described(capsys, model.name)
    assert {link.get('name') for link in robot.findall('link')} == LINKS
    joint, = robot.findall('joint')
    assert numbers(joint.find('origin'), 'xyz') == [0.0, 0.0, model.wheel_radius]
    disc, nose = robot.findall('link/visual')
    assert float(disc.find('geometry/cylinder').get('radius')) == model.body_radius
    assert numbers(nose.find('origin'), 'xyz')[:2] == [model.body_radius / 2.0, 0.0]    # x is forward


def test_a_robot_in_a_namespace_has_frames_of_its_own(capsys):
    robot = described(capsys, 'burger', 'robot3/')
    named = {link.get('name') for link in robot.findall('link')}
    assert named == {'robot3/' + name for name in LINKS}
    ends = robot.findall('joint/parent') + robot.findall('joint/child')
    assert {end.get('link') for end in ends} == named


def test_an_unknown_model_is_one_line(capsys):
    line = main('vacuum')
    assert capsys.readouterr().out == '' and '\n' not in line
    assert line.startswith("robot_description: model = 'vacuum' is not valid: one of burger, ")
