"""The URDF for RViz: the simple shape against the robots' numbers, and the choice of the source."""
import math
import re
import shutil
from xml.etree import ElementTree

import pytest

from tb3_labs.robot.turtlebot3 import MODELS, WHEEL_JOINTS
from tb3_labs.ros.robot_description import main

LINKS = {'base_footprint', 'base_link', 'wheel_left_link', 'wheel_right_link'}

#: A stand-in for xacro: its link has the name of the file that was asked for.
XACRO = '#!/bin/sh\necho "<robot name=\'r\'><link name=\'$(basename $1)\'/></robot>"\n'


@pytest.fixture
def machine(tmp_path, monkeypatch):
    """Makes a machine: without turtlebot3_description, or with it and a stand-in xacro."""
    programs, packages = tmp_path / 'bin', tmp_path / 'packages'
    programs.mkdir()
    packages.mkdir()
    (programs / 'rospack').symlink_to(shutil.which('rospack'))
    monkeypatch.setenv('ROS_PACKAGE_PATH', str(packages))
    monkeypatch.delenv('TURTLEBOT3_MODEL', raising=False)

    def install(xacro=None):
        (packages / 'turtlebot3_description').mkdir()
        (packages / 'turtlebot3_description' / 'package.xml').write_text(
            '<package format="2"><name>turtlebot3_description</name></package>')
        monkeypatch.setenv('PATH', '{}:/usr/bin:/bin'.format(programs) if xacro else str(programs))
        if xacro:
            (programs / 'xacro').write_text(xacro)
            (programs / 'xacro').chmod(0o755)
    return install


def described(capsys, *words):
    """The robot that the script prints."""
    assert main(*words) == 0
    output = capsys.readouterr()
    assert output.err == ''
    return ElementTree.fromstring(output.out)


def numbers(element, attribute):
    return [float(word) for word in element.get(attribute).split()]


@pytest.mark.parametrize('model', MODELS.values())
def test_the_simple_shape_is_as_large_as_the_robot(machine, capsys, model):
    robot = described(capsys, model.name)
    joints = {joint.get('name'): joint for joint in robot.findall('joint')}
    bodies = {link.get('name'): link for link in robot.findall('link')}
    assert set(bodies) == LINKS and set(joints) == {'base_joint'}.union(WHEEL_JOINTS)
    assert (joints['base_joint'].find('parent').get('link'),
            joints['base_joint'].find('child').get('link')) == ('base_footprint', 'base_link')
    axle = numbers(joints['base_joint'].find('origin'), 'xyz')
    assert axle[:2] == [0.0, 0.0]
    for name, side in zip(WHEEL_JOINTS, (1.0, -1.0)):
        joint = joints[name]
        assert (joint.get('type'), joint.find('parent').get('link')) == ('continuous', 'base_link')
        assert numbers(joint.find('axis'), 'xyz') == [0.0, 1.0, 0.0]      # forward is positive
        x, y, z = numbers(joint.find('origin'), 'xyz')
        assert (x, y) == (0.0, side * model.wheel_separation / 2.0)
        visual = bodies[joint.find('child').get('link')].find('visual')
        wheel = visual.find('geometry/cylinder')
        assert axle[2] + z == float(wheel.get('radius')) == model.wheel_radius    # on the floor
        assert numbers(visual.find('origin'), 'rpy') == pytest.approx([math.pi / 2.0, 0.0, 0.0])
        assert math.hypot(abs(y) + float(wheel.get('length')) / 2.0,
                          model.wheel_radius) < model.body_radius
    disc = bodies['base_link'].find('visual/geometry/cylinder')
    assert float(disc.get('radius')) == model.body_radius
    colours = {material.get('name') for material in robot.findall('material')}
    assert {material.get('name') for material in robot.findall('link/visual/material')} <= colours


def test_a_robot_in_a_namespace_has_frames_of_its_own(machine, capsys):
    robot = described(capsys, 'burger', 'robot3/')
    named = {link.get('name') for link in robot.findall('link')}
    assert named == {'robot3/' + name for name in LINKS}
    ends = robot.findall('joint/parent') + robot.findall('joint/child')
    assert {end.get('link') for end in ends} == named
    # joint_states has the namespace in its own name
    assert {joint.get('name') for joint in robot.findall('joint')} > set(WHEEL_JOINTS)


@pytest.mark.parametrize('prefix', ['', 'robot3/'])
def test_the_robots_own_description_where_it_is_installed(machine, capsys, prefix):
    machine(XACRO)
    robot = described(capsys, 'waffle_pi', prefix)
    assert robot.find('link').get('name') == prefix + 'turtlebot3_waffle_pi.urdf.xacro'


@pytest.mark.parametrize('xacro, said', [
    (None, 'xacro is missing'),
    ('#!/bin/sh\necho "warning: old" >&2\necho "error: no such macro" >&2\nexit 2\n',
     r'turtlebot3_burger\.urdf\.xacro: warning: old error: no such macro'),
    ('#!/bin/sh\necho "<robot>"\n', 'not a URDF')])
def test_what_cannot_be_described_is_said_in_one_line(machine, capsys, xacro, said):
    machine(xacro)
    line = main('burger')
    assert capsys.readouterr().out == '' and '\n' not in line
    assert line.startswith('robot_description: ') and re.search(said, line), line
