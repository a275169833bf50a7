"""Computes the robot's pose in a local frame, which a reset may declare again at any moment.

Samples of IMU and odometry arrive in any order, at different rates. A `StampedPose` consists of the
place and the stamp of an odometry message, and of the IMU's yaw interpolated to this stamp. A
*reset* waits for samples after the request and interpolates the samples of both sensors to the
moment of the request. A reset corrects any error of the old frame.

After a jump of the odometry, either ``local`` is shifted in ``odom``, or the pose is lost until the
next reset (:mod:`tb3_labs.localization.odometry_jumps`).

Units: metres, radians, seconds on the receiver's clock (`now`).
"""
import math
from dataclasses import dataclass
from typing import List, Optional

from tb3_labs.geometry.angles import wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.handout import PRINTED_POSE_SET
from tb3_labs.localization.local_frame import LocalFrame
from tb3_labs.localization.odometry_jumps import POSE_LOST, Jump, JumpFinder
from tb3_labs.localization.sample_buffer import SampleBuffer
from tb3_labs.localization.sample_timing import SampleTiming, TimedSample, YawNoise
from tb3_labs.robot.samples import Motion, heading_jump_text
from tb3_labs.robot.turtlebot3 import CONTROL_RATE
from tb3_labs.supervision.events import Queue
from tb3_labs.supervision.goal_requests import RequestedPose
from tb3_labs.supervision.timeouts import RESET_SILENCE

MAX_EXTRAPOLATION_TIME = 2.0 / CONTROL_RATE    # [s]; no pose is extrapolated for longer than this


@dataclass(frozen=True)
class StampedPose:
    """The robot's pose at the `stamp` [s, sender's clock] of one odometry message."""

    stamp: float
    local_T_base: Pose2
    frame_number: int = 0    # each reset begins a new frame


@dataclass
class Reset:
    """A request to declare the robot's pose, and its outcome."""

    requested_pose: RequestedPose
    requested_at: float = 0.0        # time of the request [s, receiver's clock]
    stamp: Optional[float] = None    # `requested_at` on the sender's clock [s]; None if unknown
    epoch: int = 0                   # epoch of the sender's clock at `stamp`
    sample_delay: float = 0.0        # samples are older by this [s] than their stamps show
    pose_before: Optional[Pose2] = None    # pose in the old frame at the request, or None
    declared_pose: Optional[Pose2] = None  # pose in the new frame; None before the reset
    reason: str = ''                 # why the reset was refused or given up
    note: str = ''                   # text that is added to the answer

    @property
    def is_done(self) -> bool:
        return self.declared_pose is not None

    @property
    def is_over(self) -> bool:
        """Returns True if the reset was carried out, refused or given up, and no longer waits."""
        return self.is_done or bool(self.reason)

    @property
    def answer(self) -> str:
        """The answer to the caller of a reset that is over."""
        return self.reason or f'{PRINTED_POSE_SET} to {self.declared_pose}{self.note}'

    def give_up(self) -> None:
        """End a reset whose caller no longer waits for the answer. The old frame stays."""
        if not self.is_over:
            self.reason = 'no sample of imu and odom at that instant'


class Localizer:
    def __init__(self, timing: SampleTiming) -> None:
        self._timing = timing
        self.frame: Optional[LocalFrame] = None    # None without a known pose
        self._frame_number = 0
        self.is_lost = False              # the pose is lost, until the next reset
        self._commanded_at = -math.inf    # time [s] of the latest known command to move
        self._jump_finder = JumpFinder()
        self.jumps: Queue[Jump] = Queue()    # jumps of both sensors
        self._buffer = SampleBuffer()
        self._yaw_noise = YawNoise()
        self._resets: List[Reset] = []    # resets that pop_ended_resets() has not returned yet
        self._odometry: Optional[TimedSample] = None  # the latest message that was used
        self._waits_for_imu = True                    # no IMU sample came since both were silent

    def on_imu(self, timed: TimedSample) -> None:
        jump_text = heading_jump_text(timed.previous_sample, timed.sample)
        if jump_text:
            self.jumps.append(Jump(jump_text))
        self._buffer.add_imu(timed)
        self._waits_for_imu = False
        self._yaw_noise.learn(timed)
        self._carry_out_resets()

    def on_command(self, now: float) -> None:
        """Store that a command to move the robot was sent at `now` [s, receiver's clock]."""
        self._commanded_at = now

    def on_odometry(self, timed: TimedSample) -> None:
        if timed.silence_of_robot > RESET_SILENCE:
            self._waits_for_imu = True
        if self._timing.imu is None or self._waits_for_imu:
            return
        jump = self._jump_finder.find(timed, self._timing.imu.sample, self._commanded_at)
        if jump is not None:
            self._on_jump(jump)
        self._buffer.add_odometry(timed)
        self._odometry = timed
        self._carry_out_resets()

    def pop_pose(self) -> Optional[StampedPose]:
        """Returns the latest new StampedPose; None if no pose is new, or if the pose is lost. While
        a reset waits, a sample from after its request gives no pose, because the reset will decide
        the frame of this pose. If no reset has declared a frame, the first pose declares it."""
        pair = self._buffer.pop_pair()
        if pair is None or self.is_lost:
            return None
        odometry, imu_yaw = pair
        if self._is_frame_undecided_at(odometry.stamp):
            return None
        if self.frame is None:
            self.frame = LocalFrame.declare(Pose2(), odometry.pose, imu_yaw)
        pose = self.frame.pose(odometry.pose, imu_yaw)
        return StampedPose(odometry.stamp, pose, self._frame_number)

    @property
    def odom_T_local(self) -> Optional[Pose2]:
        """The pose of ``local`` in ``odom``; None before the first `StampedPose`."""
        return None if self.frame is None else self.frame.odom_T_local

    def pop_ended_resets(self) -> List[Reset]:
        """Returns the resets that ended since the previous call, in order."""
        ended_resets = [reset for reset in self._resets if reset.is_over]
        self._resets = self.waiting_resets
        return ended_resets

    def on_reset(self, reset: Reset, now: float, sample_delay: float = 0.0) -> None:
        """Declare that the robot is at `reset.requested_pose` at the time `now`. Resets are carried
        out in order. Samples are `sample_delay` [s] older than their stamps show."""
        reset.requested_at = now
        reset.sample_delay = sample_delay
        self._convert_request(reset)
        self._resets.append(reset)

    @property
    def waiting_resets(self) -> List[Reset]:
        """The resets that wait for samples, in order."""
        return [reset for reset in self._resets if not reset.is_over]

    def motion(self, now: float) -> Optional[Motion]:
        """Returns the robot's Motion at `now`; None before the first samples, and while the pose is
        lost. The caller must check that the samples are fresh."""
        imu = self._timing.imu
        odometry = self._odometry
        if self.frame is None or imu is None or odometry is None:
            return None
        imu_age = imu.age(now)
        turn = imu.sample.yaw_rate * min(imu_age, MAX_EXTRAPOLATION_TIME)
        heading = self.frame.heading(imu.sample.yaw + turn)

        odometry_age = odometry.age(now)
        speed = odometry.sample.linear
        distance = speed * min(odometry_age, MAX_EXTRAPOLATION_TIME)
        place = self.frame.pose(odometry.sample.pose, imu.sample.yaw)
        pose = Pose2(place.x + distance * math.cos(heading),
                     place.y + distance * math.sin(heading), heading)
        return Motion(pose, linear=speed, angular=imu.sample.yaw_rate, imu_age=imu_age,
                      odometry_age=odometry_age, yaw_noise=self._yaw_noise.deviation,
                      extrapolated_turn=turn)

    def _is_frame_undecided_at(self, stamp: float) -> bool:
        """Returns True if a waiting reset will decide the frame at `stamp`. This `stamp` is after
        the request of the reset, but not after the samples for which the reset waits."""
        return any(reset.stamp is not None and 0.0 < stamp - reset.stamp <= reset.sample_delay
                   for reset in self.waiting_resets)

    def _on_jump(self, jump: Jump) -> None:
        if jump.text:
            self.jumps.append(jump)
        if jump.outcome == POSE_LOST:
            self._lose_pose()
            return
        self._buffer.shift(jump.shift)
        if self.frame is not None:
            self.frame = LocalFrame(jump.shift @ self.frame.odom_T_local,
                                    wrap(self.frame.imu_yaw_at_zero + jump.imu_turn))

    def _lose_pose(self) -> None:
        """Forget the frame, and the samples from before the jump, which belong to it."""
        for reset in self.waiting_resets:
            reset.reason = 'the robot started anew at that moment'
        self.frame = None
        self._buffer = SampleBuffer()
        self.is_lost = True

    def _convert_request(self, reset: Reset) -> None:
        reset.stamp = self._timing.clock.to_sender_time(reset.requested_at)
        reset.epoch = self._timing.clock.epoch

    def _carry_out_resets(self) -> None:
        for reset in self.waiting_resets:
            if reset.stamp is None:
                self._convert_request(reset)
            if reset.epoch != self._timing.clock.epoch:    # the samples for the reset are lost
                reset.reason = "the robot's clock was set at that moment, or its messages ceased"
                continue
            if reset.stamp is None:
                return    # later resets must also wait
            readings = self._buffer.readings_at(reset.stamp + reset.sample_delay)
            if readings is None:
                return
            self._carry_out(reset, *readings)

    def _carry_out(self, reset: Reset, odom_T_base: Pose2, imu_yaw: float) -> None:
        try:
            reset.declared_pose = reset.requested_pose.to_local(self.odom_T_local)
        except ValueError as error:
            reset.reason = str(error)
            return
        if self.frame is not None:
            reset.pose_before = self.frame.pose(odom_T_base, imu_yaw)
        self.frame = LocalFrame.declare(reset.declared_pose, odom_T_base, imu_yaw)
        self._frame_number += 1
        self.is_lost = False
