"""Odometry against wheels: a robot whose battery is cut in a drive, and sound ones."""
import itertools

import pytest

from real_recordings import NAMES, arrays_of
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.localization.encoders import CAUSE, EncoderWatch
from tb3_labs.robot.samples import OdometrySample, WheelSample
from tb3_labs.simulation.network import NETWORKS
from tb3_labs.simulation.simulator_config import HOSTS
from tb3_labs.supervision.arbitration import Driver
from test_contradiction import MOTIONS, Watched, controller, navigator


class Ear(EncoderWatch):
    """An EncoderWatch that hears a Watched robot."""

    def on_imu(self, sample, now):
        pass

    def on_wheels(self, sample, now):
        super().on_wheels(sample)

    def take_fix(self):
        pass

    def on_odometry(self, sample, now=0.0):
        super().on_odometry(sample)


@pytest.mark.parametrize('settings', [
    {}, {'slip': 1.0}, {'motors_off': True}, {'motor_lag': 0.5}, {'odom_rate': 200.0},
    {'odom_frozen': True}, {'dropouts_per_min': 60.0}, {'imu_frozen': True}, {'stamp_step': 0.25},
    dict(HOSTS['pi'], **NETWORKS['bad']), *HOSTS.values(), *NETWORKS.values()], ids=str)
def test_no_sound_robot_is_accused(settings):
    watched = Watched(Ear(), **settings)
    for linear, angular, seconds in MOTIONS + [(0.01, 0.0, 1.0), (0.1, 1.25, 1.0)]:
        watched.run(seconds, linear, angular, until=watched.problem)
        assert watched.problem() == '', (linear, angular)
    watched.robot.reset()
    watched.run(3.0)
    assert watched.problem() == ''


@pytest.mark.parametrize('name', NAMES)
def test_a_recorded_robot_is_not_accused(name):
    watch = EncoderWatch()
    odometry, wheels = arrays_of(name, ('odometry', 'wheels'))
    for _, row in sorted([(row[0], row) for row in itertools.chain(
            odometry.tolist(), wheels.tolist())], key=lambda pair: pair[0]):
        if len(row) == 4:
            watch.on_wheels(WheelSample(*row[1:]))
        else:
            _, stamp, x, y, yaw, linear, angular = row
            watch.on_odometry(OdometrySample(stamp, Pose2(x, y, yaw), linear, angular))
        assert watch.problem() == ''


@pytest.mark.parametrize('settings', [{}, HOSTS['pi'], NETWORKS['busy'],
                                      dict(HOSTS['pi'], stamp_step=0.25)], ids=str)
@pytest.mark.parametrize('way', [0.01, 1.0, 1.97])
def test_a_drive_is_given_up_within_2_s_when_the_battery_is_cut(settings, way):
    """It speeds up, drives, or brakes for its goal, 2 m away. Afterwards it is not driven again."""
    drives = navigator()
    watched = Watched(drives, **settings)
    watched.run(0.5)
    drives.set_goal(Pose2(2.0, 0.0, 0.0))
    watched.run(12.0, until=lambda: watched.robot.truth.x > way)
    assert watched.robot.true_velocity[0] > 0.02
    watched.set(battery_cut=True)
    watched.run(2.0)
    assert drives.status(watched.robot.now).failure == CAUSE
    drives.set_goal(Pose2(3.0, 0.0, 0.0))
    watched.run(1.0)
    assert drives.status(watched.robot.now).failure == CAUSE


@pytest.mark.parametrize('after', [0.3, 1.0])
def test_a_turn_is_given_up_within_2_s_when_the_battery_is_cut(after):
    """The odometry has no forward speed: the gyro shows that the robot does not turn."""
    drives, turns = navigator(), controller()
    watched = Watched(drives)
    watched.run(0.5)
    drives.set_goal(Pose2(-1.0, 0.1, 0.0))
    watched.run(after)
    watched.set(battery_cut=True)
    watched.run(2.0)
    assert 'does not move although it is told to' in drives.status(watched.robot.now).failure

    watched = Watched(turns)
    watched.run(0.5)
    turns.ask(180.0, watched.robot.now)
    watched.run(after)
    watched.set(battery_cut=True)
    watched.run(2.0)
    assert turns.driver is Driver.NOBODY
    assert any('does not move although it is told to' in news.text for news in turns.take_news())


def test_without_joint_states_or_stamps_nothing_is_said():
    deaf, stampless = EncoderWatch(), EncoderWatch()
    for k in range(100):
        deaf.on_odometry(OdometrySample(0.033 * k, Pose2(0.007 * k, 0.0), 0.2, 0.0))
        stampless.on_odometry(OdometrySample(0.0, Pose2(0.007 * k, 0.0), 0.2, 0.0))
        stampless.on_wheels(WheelSample(0.0, 1.0, 1.0))
    assert deaf.problem() == stampless.problem() == ''
