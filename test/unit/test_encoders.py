"""Odometry against wheels, when the battery is cut in a motion; test_gyro_check.py has sound robots."""
import pytest

from real_recordings import NAMES, arrays_of
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.localization.odometry_jumps import SERVOS_SILENT, EncoderMonitor
from tb3_labs.robot.samples import OdometrySample, WheelSample
from tb3_labs.simulation.network import NETWORKS
from tb3_labs.simulation.simulator_config import HOSTS
from test_gyro_check import Watched, navigator


@pytest.mark.parametrize('settings, way', [
    ({}, 0.01), (dict(HOSTS['pi'], stamp_step=0.22), 0.5), (NETWORKS['busy'], 0.97)])
def test_a_drive_is_given_up_within_2_s_when_the_battery_is_cut(settings, way):
    """The robot speeds up, drives, or brakes for its goal, 1 m away. Then no drive follows."""
    drives = navigator()
    watched = Watched(drives, **settings)
    watched.run(0.5)
    drives.set_goal(Pose2(1.0, 0.0, 0.0))
    watched.run(12.0, until=lambda: watched.robot.truth.x > way)
    watched.set(battery_cut=True)
    for goal in 1.0, 2.0:
        watched.run(2.0)
        assert drives.status(watched.robot.now).failure == SERVOS_SILENT
        drives.set_goal(Pose2(goal, 0.0, 0.0))


@pytest.mark.parametrize('name', NAMES)
def test_a_recorded_robot_is_not_accused(name):
    watch = EncoderMonitor()
    for row in sorted(sum((table.tolist() for table in arrays_of(name, ('odometry', 'wheels'))), [])):
        if len(row) == 4:
            watch.on_wheels(WheelSample(*row[1:]))
        else:
            watch.on_odometry(OdometrySample(row[1], Pose2(*row[2:5]), *row[5:]))
        assert watch.problem_text() == ''


def test_without_joint_states_or_stamps_nothing_is_said():
    deaf, stampless = EncoderMonitor(), EncoderMonitor()
    for k in range(100):
        deaf.on_odometry(OdometrySample(0.033 * k, Pose2(0.007 * k, 0.0), 0.2, 0.0))
        stampless.on_odometry(OdometrySample(0.0, Pose2(0.007 * k, 0.0), 0.2, 0.0))
        stampless.on_wheels(WheelSample(0.0, 1.0, 1.0))
    assert deaf.problem_text() == stampless.problem_text() == ''
