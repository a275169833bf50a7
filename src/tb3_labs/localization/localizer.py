"""Follows the robot in a local frame that can be declared anew at any moment.

IMU and odometry arrive in any order, at rates of their own. A *fix* is the robot's pose at the
instant of one odometry message, with the IMU's yaw interpolated to its stamp. A *reset* takes
both at the instant at which it was asked for, so it is as exact while the robot spins as at
rest; it is carried out as soon as both sensors have passed that instant. Where the odometry jumps
and the robot does not, ``local`` moves along in ``odom``, so that the robot keeps its pose in it
(:mod:`tb3_labs.localization.odometry_jumps`).

Units: metres, radians, seconds on the receiver's clock (`now`); the caller provides the time.
"""
import math
from dataclasses import dataclass
from typing import NamedTuple, Optional, Union

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.localization.local_frame import LocalFrame
from tb3_labs.localization.odometry_jumps import POSE_LOST, Jump, JumpFilter
from tb3_labs.localization.sample_buffer import SampleBuffer
from tb3_labs.localization.yaw_noise import YawNoise
from tb3_labs.robot.samples import ImuSample, OdometrySample, heading_jump
from tb3_labs.robot.turtlebot3 import CONTROL_RATE

#: Motion is carried on from the newest samples for two control periods, in which a command takes
#: effect and is seen; what a robot does later than that, nobody knows [s].
MAX_EXTRAPOLATION = 2.0 / CONTROL_RATE


@dataclass(frozen=True)
class Fix:
    """The robot's pose at one odometry message's `stamp` [s, sender's clock]."""

    stamp: float
    local_T_base: Pose2


@dataclass(frozen=True)
class Motion:
    """The robot as a controller wants it: pose in ``local`` now, and measured speeds.

    The pose is carried on from the newest samples, for `MAX_EXTRAPOLATION` at most. Their ages
    count from when they were measured, by the least delay.
    """

    pose: Pose2
    linear: float               # [m/s], from the wheels
    angular: float              # [rad/s], from the gyro
    imu_age: float = 0.0        # [s]
    odometry_age: float = 0.0   # [s]
    yaw_noise: float = 0.0      # standard deviation of a sample's yaw [rad]


@dataclass
class Reset:
    """One declaration; `before` and `after` are filled in when it is carried out."""

    declared: Pose2
    asked_at: float                  # [s, receiver's clock]
    stamp: Optional[float]           # the same instant [s, sender's clock]; None: no sample yet
    epoch: int                       # of the history in which `stamp` counts
    before: Optional[Pose2] = None
    after: Optional[Pose2] = None
    problem: str = ''                # why it can no longer be carried out

    @property
    def done(self):
        """True once the new frame is in force."""
        return self.after is not None


class _Newest(NamedTuple):
    """The newest sample of one sensor, and when it was measured [s, receiver's clock]."""

    sample: Union[ImuSample, OdometrySample]
    measured_at: float


class Localizer:
    """Takes samples in, answers with poses in the local frame."""

    def __init__(self):
        #: The LocalFrame in force, in steady odometry; None before the first pair of samples.
        self.frame = None
        self._steady = JumpFilter()
        self._jumps = []
        self._history = SampleBuffer()
        self._yaw_noise = YawNoise()
        self._resets = []
        self._imu = None
        self._odometry = None

    def on_imu(self, sample, now):
        """Take an ImuSample in. Returns the resets that were carried out by it."""
        jump = heading_jump(self._imu.sample.yaw, sample.yaw) if self._imu else ''
        if jump:
            self._jumps.append(Jump(jump))
        time = self._history.add_imu(sample, now)
        self._imu = _Newest(sample, self._history.clock.measured_at(time, now))
        self._yaw_noise.learn(sample, time)
        return self._carry_out_resets()

    def on_odometry(self, sample, now):
        """Take an OdometrySample in. Returns the resets that were carried out by it."""
        if self._imu is not None:
            sample, jump = self._steady.take(sample, now, self._imu.sample)
            if jump is not None:
                self._on_jump(jump)
        time = self._history.add_odometry(sample, now)
        self._odometry = _Newest(sample, self._history.clock.measured_at(time, now))
        return self._carry_out_resets()

    def take_fix(self):
        """The newest Fix that was not taken yet, or None.

        The first one is at (0, 0, 0), unless a reset came before it.
        """
        pair = self._history.take_pair()
        if pair is None:
            return None
        odometry, imu_yaw = pair
        if self.frame is None:
            self.frame = LocalFrame.declared(Pose2(), odometry.pose, imu_yaw)
        return Fix(odometry.stamp, self.frame.pose(odometry.pose, imu_yaw))

    @property
    def odom_T_local(self):
        """Where ``local`` stands in the odometry's own frame; None before the first fix."""
        if self.frame is None:
            return None
        return self._steady.steady_T_odom.inverse() @ self.frame.odom_T_local

    def take_jumps(self):
        """The steady_odometry.Jumps of both sensors since the last call."""
        jumps, self._jumps = self._jumps, []
        return jumps

    def reset(self, declared, now):
        """Declare that the robot is at `declared` in local at `now`. Returns the Reset to watch."""
        reset = Reset(declared, now, self._history.clock.stamp_of(now), self._history.clock.epoch)
        self._resets.append(reset)
        return reset

    def give_up(self, reset):
        """Forget a Reset that has not been carried out: the old frame stays."""
        if reset in self._resets:
            self._resets.remove(reset)

    @property
    def has_resets(self):
        """Are there resets that wait for the samples of their instant?"""
        return bool(self._resets)

    def motion(self, now):
        """The robot's Motion at `now`; None before the first samples.

        However old they are: the caller checks that they are fresh. Where the clock went back since
        they were measured, they count as new.
        """
        if self.frame is None:
            return None
        imu, imu_age = self._imu.sample, max(0.0, now - self._imu.measured_at)
        odometry = self._odometry.sample
        odometry_age = max(0.0, now - self._odometry.measured_at)
        heading = self.frame.heading(
            imu.yaw + imu.yaw_rate * min(imu_age, MAX_EXTRAPOLATION))
        place = self.frame.pose(odometry.pose, imu.yaw)
        driven = odometry.linear * min(odometry_age, MAX_EXTRAPOLATION)
        pose = Pose2(place.x + driven * math.cos(heading), place.y + driven * math.sin(heading),
                     heading)
        return Motion(pose, odometry.linear, imu.yaw_rate, imu_age, odometry_age,
                      self._yaw_noise.deviation)

    def _on_jump(self, jump):
        self._jumps.append(jump)
        if jump.outcome == POSE_LOST:    # nothing that was known counts any more
            self._drop_resets('the robot started anew at that moment')
            self.frame, self._history = None, SampleBuffer()

    def _drop_resets(self, problem):
        for reset in self._resets:
            reset.problem = problem
        self._resets = []

    def _carry_out_resets(self):
        done = []
        for reset in list(self._resets):
            if reset.stamp is None:
                reset.stamp, reset.epoch = (
                    self._history.clock.stamp_of(reset.asked_at), self._history.clock.epoch)
            if reset.epoch != self._history.clock.epoch:
                reset.problem = "the robot's clock was set at that moment, or its messages ceased"
                self._resets.remove(reset)   # its instant is lost
                continue
            instant = self._history.at(reset.stamp)
            if instant is None:
                continue
            if self.frame is not None:
                reset.before = self.frame.pose(instant.odom_T_base, instant.imu_yaw)
            self.frame = LocalFrame.declared(
                reset.declared, instant.odom_T_base, instant.imu_yaw)
            reset.after = reset.declared
            self._resets.remove(reset)
            done.append(reset)
        return done

