"""The heading that a node prints in the IMU exercise: closed forms, no ROS."""
import math

import numpy as np
import pytest
from made_run import made, speeds_sent

from tb3_labs.recording.run_data import ImuSamples, Texts
from tb3_labs.watch.lab_mistakes import CHECKS
from tb3_labs.watch.mistake import NodeRun, find_first_mistake


def told(node_run, lab='imu'):
    found = find_first_mistake(node_run, CHECKS[lab])
    return found and found.message


def test_a_run_without_variables_and_lines_has_no_mistake():
    sent = speeds_sent(*(np.arange(30.0) for _ in range(4)))
    for lab in CHECKS:
        assert told(NodeRun(made(commands=sent, imu=ImuSamples.none())), lab) is None


def printed_run(number, late=0):
    """A node that prints ``number(yaw [deg], roll [deg], ...)`` of a robot that turns twice."""
    time = np.arange(0.0, 12.0, 0.01)
    yaw = (60.0 * time + 40.0 * np.sin(time) + 180.0 + 37.0) % 360.0 - 180.0
    y, r, roll = np.radians(yaw) / 2.0, np.radians(2.5 * np.sin(time)), 5.0 * np.sin(time)
    quaternion = np.cos(y) * np.cos(r), np.cos(y) * np.sin(r), np.sin(y) * np.sin(r), np.sin(y) * np.cos(r)
    imu = ImuSamples(time, time, np.radians(yaw), 0.0 * time, *quaternion)
    steps = np.arange(late, len(time), 10)
    printed = time[steps] + 0.002
    lines = ['Current heading is {:f} degrees.\n'.format(number(yaw[k - late], roll[k - late])) for k in steps]
    return NodeRun(made(duration=12.0, imu=imu, printed=Texts(printed, printed, np.array(lines, dtype=object))))


@pytest.mark.parametrize('number, late, said', [
    (lambda yaw, roll: yaw % 360.0, 0, None),
    (lambda yaw, roll: yaw, 0, 'follows the yaw in degrees, from -180 to 180; it should be the heading'),
    (lambda yaw, roll: math.radians(yaw), 0, 'follows the yaw in radians'),
    (lambda yaw, roll: roll, 0, 'follows the roll in degrees'),
    (lambda yaw, roll: abs(yaw), 0, 'follows the yaw in degrees, without its sign'),
    (lambda yaw, roll: (yaw - 37.0) % 360.0, 0, 'follows the heading (at first 37.0 degrees) -37.0 degrees, in degr'),
    (lambda yaw, roll: yaw % 360.0, 150, 'follows the heading, from 0 to 360 degrees, up to 1.5 s late'),
    (lambda yaw, roll: 12.0, 0, 'the printed number stays at 12')])
def test_the_printed_quantity_is_named(number, late, said):
    found = told(printed_run(number, late))
    assert found is None if said is None else said in found
