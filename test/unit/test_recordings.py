"""Two drives of a real TurtleBot3 through the localizer, against the recordings themselves.

The expected poses are computed here from the raw messages: the odometry's displacement turned back
by the odometry's yaw at the reset, and the difference of the IMU's yaws. One displacement in the
recordings has the firmware's fault at +/-180 deg, exactly backwards; it is reversed here first.
"""
import math

import numpy as np
import pytest

from known_motion import angle_between
from real_recordings import NAMES, arrays_of
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.samples import ImuSample, OdometrySample
from tb3_labs.supervision.goal_requests import RequestedPose
from timed_part import TimedPart

METRES, RADIANS = 0.001, math.radians(0.2)


class SensorRecording:
    """The raw messages as arrays; yaws unwrapped."""

    def __init__(self, name):
        imu, odometry = arrays_of(name)
        self.arrivals = sorted(
            [(arrival, ImuSample(*sample)) for arrival, *sample in imu.tolist()]
            + [(arrival, OdometrySample(stamp, Pose2(x, y, yaw), linear, angular))
               for arrival, stamp, x, y, yaw, linear, angular in odometry.tolist()],
            key=lambda pair: pair[0])
        self.imu, self.odometry = imu[:, 1:3].copy(), odometry[:, 1:5].copy()
        speeds = odometry[:, 5:]
        for table in self.imu, self.odometry:
            table[:, -1] = np.unwrap(table[:, -1])
        self.faults = [number for number, (_, angular) in enumerate(speeds) if abs(angular) > 100.0]
        for number in self.faults:
            step = self.odometry[number, 1:3] - self.odometry[number - 1, 1:3]
            yaw = self.odometry[number, 3]
            assert step @ (math.cos(yaw), math.sin(yaw)) * speeds[number][0] < 0.0
            self.odometry[number:, 1:3] -= 2.0 * step

    def at(self, stamp):
        """(x, y, odometry's yaw, IMU's yaw) at an instant of the robot's clock."""
        x, y, yaw = (np.interp(stamp, self.odometry[:, 0], column)
                     for column in self.odometry[:, 1:].T)
        return x, y, yaw, np.interp(stamp, self.imu[:, 0], self.imu[:, 1])

    def expected(self, declared, reset_stamp, stamp):
        """(x, y, yaw) in local: the declared pose, and the motion of the recording since."""
        x0, y0, yaw0, imu0 = self.at(reset_stamp)
        x, y, _, imu = self.at(stamp)
        forward = math.cos(yaw0) * (x - x0) + math.sin(yaw0) * (y - y0)
        left = -math.sin(yaw0) * (x - x0) + math.cos(yaw0) * (y - y0)
        cos, sin = math.cos(declared.yaw), math.sin(declared.yaw)
        return (declared.x + cos * forward - sin * left, declared.y + sin * forward + cos * left,
                declared.yaw + imu - imu0)


@pytest.fixture(scope='module', params=NAMES)
def recording(request):
    return SensorRecording(request.param)


def replay(recording, requested=()):
    """(poses, resets) of a localizer, `requested` being [(time of the recorder, declared pose)]."""
    localizer, waiting, resets, poses = TimedPart.localizer(), list(requested), [], []
    for arrival, sample in recording.arrivals:
        while waiting and waiting[0][0] <= arrival:
            resets.append(localizer.reset(RequestedPose(waiting[0][1]), waiting.pop(0)[0]))
        if isinstance(sample, ImuSample):
            localizer.on_imu(sample, arrival)
        else:
            localizer.on_odometry(sample, arrival)
        stamped = localizer.pop_pose()
        if stamped is not None:
            poses.append(stamped)
    return poses, resets


def assert_follows(recording, poses, declared, reset_stamp, begin=0.0):
    """From `begin` on, the place is within 1 mm, the heading within 0.2 deg of the recording's transform."""
    assert any(stamped.stamp >= begin for stamped in poses)
    for stamped in (stamped for stamped in poses if stamped.stamp >= begin):
        x, y, yaw = recording.expected(declared, reset_stamp, stamped.stamp)
        pose = stamped.local_T_base
        assert math.hypot(pose.x - x, pose.y - y) <= METRES, (stamped, x, y)
        assert angle_between(pose.yaw, yaw) <= RADIANS, (stamped, yaw)


def assert_instant(recording, reset):
    """A reset's stamp is its instant on the robot's clock, within the error of the delays."""
    delays = [arrival - sample.stamp for arrival, sample in recording.arrivals
              if abs(arrival - reset.requested_at) < 3.0]
    assert min(delays) <= reset.requested_at - reset.stamp <= max(delays)


@pytest.mark.parametrize('declared, seconds', [
    (Pose2(), 5.0), (Pose2(1.0, -2.0, 2.5), 11.1), (Pose2(-0.61, 0.61, math.pi), 23.45)])
def test_a_reset_on_the_way(recording, declared, seconds):
    requested_at = recording.arrivals[0][0] + seconds
    poses, (reset,) = replay(recording, [(requested_at, declared)])
    assert len(poses) >= 0.95 * len(recording.odometry)
    assert_instant(recording, reset)
    before = [stamped for stamped in poses if stamped.stamp < reset.stamp]
    assert_follows(recording, before, Pose2(), poses[0].stamp)
    assert_follows(recording, poses, declared, reset.stamp, reset.stamp + 0.2)
