"""A robot whose true motion is known in closed form, and the samples of its sensors.

Places are complex numbers here, so that the truth does not come from the code under test.
"""
import cmath
import math
from dataclasses import dataclass
from typing import NamedTuple

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.samples import ImuSample, OdometrySample


class Truth(NamedTuple):
    """A pose: `place` x + iy [m], `yaw` [rad] on the whole line, never wrapped."""

    place: complex
    yaw: float

    def then(self, place, yaw):
        """The pose after a motion that is given relative to this pose."""
        return Truth(self.place + cmath.exp(1j * self.yaw) * place, self.yaw + yaw)


def on_circle(angle):
    """The angle in (-pi, pi] by way of the unit circle."""
    return cmath.phase(cmath.exp(1j * angle))


def angle_between(one, other):
    """Size of the turn between two directions [rad]."""
    return abs(on_circle(one - other))


def as_pose2(truth):
    return Pose2(truth.place.real, truth.place.imag, on_circle(truth.yaw))


def assert_pose(pose, truth, metres=1e-9, radians=1e-9):
    """`pose` (Pose2) is `truth` (Truth), its yaw in (-pi, pi]."""
    assert abs(complex(pose.x, pose.y) - truth.place) <= metres, (pose, truth)
    assert angle_between(pose.yaw, truth.yaw) <= radians, (pose, truth)
    assert -math.pi < pose.yaw <= math.pi


def odometry_sample(x=0.0, y=0.0, yaw=0.0, stamp=0.0, linear=0.0, angular=0.0):
    return OdometrySample(stamp, Pose2(x, y, yaw), linear, angular)


def held_back(messages, begin, end):
    """The messages of a network that stalls, then delivers the delayed ones, source by source."""
    late = [(end, sample) for arrival, sample in messages if begin < arrival < end]
    late.sort(key=lambda message: isinstance(message[1], OdometrySample))
    return ([message for message in messages if message[0] <= begin] + late +
            [message for message in messages if message[0] >= end])


@dataclass(frozen=True)
class SteadyRobot:
    """Drives one arc for ever: constant speed and rate of turn, exact sensors."""

    linear: float = 0.0                             # [m/s]
    angular: float = 0.0                            # [rad/s]
    odometry_start: Truth = Truth(0j, 0.0)          # the odometry's pose at time 0
    imu_offset: float = 0.0                         # IMU yaw minus odometry yaw [rad]
    clock_ahead: float = 0.0                        # of the receiver's clock [s]

    def moved(self, seconds):
        """(place, yaw) after this time, relative to the start."""
        turn = self.angular * seconds
        # the chord of the arc; by the radius a tiny rate of turn would be infinity times zero
        half = 0.5 * turn
        chord = self.linear * seconds * (math.sin(half) / half if half else 1.0)
        return cmath.rect(chord, half), turn

    def odometry(self, time):
        pose = as_pose2(self.odometry_start.then(*self.moved(time)))
        return OdometrySample(time + self.clock_ahead, pose, self.linear, self.angular)

    def imu(self, time):
        yaw = self.odometry_start.yaw + self.imu_offset + self.angular * time
        return ImuSample(time + self.clock_ahead, on_circle(yaw), self.angular)

    def messages(self, begin, end, imu_rate=200.0, odometry_rate=30.0, imu_delay=lambda: 0.0,
                 odometry_delay=lambda: 0.0):
        """[(arrival, sample)] in order of arrival."""
        messages = []
        for sensor, rate, delay in ((self.imu, imu_rate, imu_delay),
                                    (self.odometry, odometry_rate, odometry_delay)):
            for k in range(math.ceil(begin * rate), math.floor(end * rate) + 1):
                messages.append((k / rate + delay(), sensor(k / rate)))
        return sorted(messages, key=lambda message: message[0])
