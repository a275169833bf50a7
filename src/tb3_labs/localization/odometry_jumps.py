"""Finds the faults of the odometry, and its jumps, which are not a motion of the robot.

There are three kinds of jumps of the odometry:

* When the IMU crosses +/-180 deg, the firmware reverses one displacement. Such a message
  contradicts itself: its rate of turn has a spike, and its displacement is opposite to its own
  speed. The robot made the opposite displacement.
* The robot's own `reset`, or a restart of its board, sets the odometry's place to zero after a
  silence, in which the motors keep their speed. If the robot stood before, it has
  not moved, and the calibration caused the IMU's turn meanwhile. Otherwise the pose is lost.
* The odometry jumps without a silence, as when the wheels spin while the robot is carried. Then
  the robot is assumed to stand where it was, turned as the IMU says. If the IMU jumps as well,
  the pose is lost.

Frames: with a jump, the frame ``odom`` itself moves. The *shift* is the pose of the old frame in
the new one: each pose in ``odom`` must be multiplied by it. Units: metres, radians, seconds.
Source: OpenCR firmware 1.2.6 (see :mod:`tb3_labs.simulation.firmware`): its `reset` takes 2.6 s,
then the odometry's yaw begins at the IMU's turn of that time. A recording of a real Burger shows a
displacement of 7.3 mm backwards at the crossing.
"""
import math
from typing import NamedTuple, Optional, Tuple

from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.localization.sample_timing import TimedSample
from tb3_labs.robot.samples import ImuSample, OdometrySample, WheelSample, is_slow
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT
from tb3_labs.supervision.timeouts import LONGEST_SILENCE, RESET_SILENCE

#: No TurtleBot3 drives faster than this [m/s].
SPEED_BOUND = 0.5
#: No TurtleBot3 turns faster than this [rad/s].
TURN_BOUND = 4.0
#: If messages arrive unevenly, a true step may exceed the bound by this [m].
SLACK = 0.05
#: If messages arrive unevenly, a true turn may exceed the bound by this [rad].
SLACK_TURN = 0.3
#: A rate of turn beyond this is the firmware's spike [rad/s].
SPIKE = 10.0
#: After a reset the odometry's place is exactly zero, and its yaw is below this [rad].
ZERO_YAW = 0.01
#: If the place was this near to zero before, a place of zero does not show a reset [m].
ZERO_PLACE = 0.001
#: The first message after a reset may have a place this far from zero: the robot may move [m].
NEAR_ZERO_PLACE = 0.03
#: The yaw of the first message after a reset may be this far from zero, or from the angle by which
#: the IMU turned [rad].
NEAR_ZERO_YAW = 0.1
#: The IMU of a robot at rest turns no farther than this between two messages [rad].
RESTING_TURN = 0.1
#: If the IMU turns farther than this in a silence, it was calibrated [rad].
CALIBRATION_TURN = 0.005
#: A turning robot comes to rest within this time after its last message [s].
STOPPING_TIME = 0.5
#: The odometry contradicts the wheels if it moves for this long while the wheels stand [s].
CONTRADICTS = 0.5
#: The contradiction in words.
SERVOS_SILENT = ('the odometry runs on but the wheels stand: the servos do not answer (battery '
                 'empty? a cable out?); switch the robot off and on')


class Jump(NamedTuple):
    """A step of a sensor that is not a motion, in words, and the outcome for the pose."""

    text: str
    outcome: str = ''
    imu_turn: float = 0.0     # turn of the IMU that the robot did not make [rad]


SET_TO_ZERO = 'the odometry was set to zero'
#: The two outcomes of a jump of the odometry.
POSE_KEPT = 'the local pose is kept'
POSE_LOST = 'pose lost: reset_pose, or place the robot and reset'


class _Gap:
    """The time between two odometry messages, between which others may be skipped."""

    def __init__(self) -> None:
        self._by_stamps = self._by_arrival = 0.0

    def add(self, timed: TimedSample) -> None:
        self._by_stamps += timed.by_stamps
        self._by_arrival += timed.silence

    @property
    def seconds(self) -> float:
        """The longer time of stamps and arrivals, up to LONGEST_SILENCE [s]."""
        return min(max(self._by_stamps, self._by_arrival, 0.0), LONGEST_SILENCE)

    @property
    def silence(self) -> float:
        """The shorter time [s]: neither delayed messages nor a clock that is set lengthen it."""
        return min(self._by_stamps, self._by_arrival) if self._by_stamps > 0.0 else self._by_arrival


class _JumpSample(NamedTuple):
    """An odometry message as sent, and the IMU's latest sample at its arrival."""

    sample: OdometrySample
    arrival: float
    imu: ImuSample

    @property
    def rests(self) -> bool:
        """Do wheels and gyro rest?"""
        return is_slow(self.sample.linear, self.imu.yaw_rate)


def _is_reset(before: _JumpSample, after: _JumpSample, gap: _Gap) -> bool:
    """Was the robot, or its board, reset between two messages?"""
    was, now = before.sample.pose, after.sample.pose
    turned = difference(after.imu.yaw, before.imu.yaw)
    is_zero = now.x == now.y == 0.0
    # after the reset of a board the IMU is near zero, too
    is_near_zero = math.hypot(now.x, now.y) <= NEAR_ZERO_PLACE and (
        min(abs(difference(now.yaw, turned)), abs(now.yaw)) <= NEAR_ZERO_YAW)
    if gap.silence <= RESET_SILENCE or not (is_zero or is_near_zero):
        return False
    contradicts_imu = abs(difference(now.yaw - was.yaw, turned)) > NEAR_ZERO_YAW
    is_calibrated = is_zero and before.rests and abs(turned) > CALIBRATION_TURN
    return was.distance_to(now) > NEAR_ZERO_PLACE or contradicts_imu or is_calibrated


class JumpFilter:
    """Finds the jumps of the odometry of one robot, message by message."""

    def __init__(self) -> None:
        self._last: Optional[_JumpSample] = None    # the last message with a new pose
        self._latest: Optional[_JumpSample] = None    # the last message
        self._since_last, self._since_latest = _Gap(), _Gap()

    def skip(self, timed: TimedSample) -> None:
        """Take in an odometry message that is not used."""
        self._since_last.add(timed)
        self._since_latest.add(timed)

    def filter(self, timed: TimedSample, imu: ImuSample,
               driven_at: float = -math.inf) -> Tuple[Optional[Pose2], Optional[Jump]]:
        """Returns (shift, jump) of an odometry message; each may be None.

        `imu`: the latest ImuSample, which shows the robot's turn while the odometry jumped;
        `driven_at`: time of the last known command to move [s, receiver's clock].
        """
        self.skip(timed)
        sample = timed.sample
        shift, jump, latest = None, None, _JumpSample(sample, timed.arrival, imu)
        if self._last is not None and self._latest is not None:
            before = self._last.sample.pose
            problem = _jump(before, sample.pose, self._since_last.seconds)
            if _is_reset(self._latest, latest, self._since_latest):
                shift, jump = self._after_reset(self._latest, latest, driven_at)
            elif problem:
                shift, jump = self._stand_still(problem, self._last, latest)
            elif _is_backwards(before, sample):
                # The robot drove the opposite of this step, from its last place.
                shift = _shift(Pose2(2.0 * before.x - sample.pose.x,
                                     2.0 * before.y - sample.pose.y, sample.pose.yaw), sample.pose)
        if self._last is None or sample.pose != self._last.sample.pose:
            self._last, self._since_last = latest, _Gap()
        self._latest, self._since_latest = latest, _Gap()
        return shift, jump

    def _after_reset(self, before: _JumpSample, after: _JumpSample,
                     driven_at: float) -> Tuple[Optional[Pose2], Jump]:
        """Returns (shift, jump) of a reset. The pose is kept if the robot surely stood."""
        turned = difference(after.imu.yaw, before.imu.yaw)
        stood = before.rests and driven_at < before.arrival - COMMAND_TIMEOUT
        if stood and abs(turned) <= RESTING_TURN and self._since_latest.seconds < LONGEST_SILENCE:
            return (_shift(before.sample.pose, after.sample.pose),
                    Jump(SET_TO_ZERO, POSE_KEPT, turned))
        return None, Jump(SET_TO_ZERO, POSE_LOST)

    @staticmethod
    def _stand_still(problem: str, last: _JumpSample,
                     now: _JumpSample) -> Tuple[Optional[Pose2], Jump]:
        """Returns (shift, jump) of a jump, if the robot stands where it was at `last`."""
        turned = difference(now.imu.yaw, last.imu.yaw)
        if abs(turned) > RESTING_TURN + STOPPING_TIME * abs(last.imu.yaw_rate):
            return None, Jump(problem, POSE_LOST)
        here = last.sample.pose
        return (_shift(Pose2(here.x, here.y, here.yaw + turned), now.sample.pose),
                Jump(problem, POSE_KEPT))


def _shift(before: Pose2, after: Pose2) -> Pose2:
    """The shift of ``odom`` by which one place of the robot is `before` in the old frame, and
    `after` in the new one."""
    return after @ before.inverse()


def _jump(before: Pose2, after: Pose2, seconds: float) -> str:
    """Returns the step between two poses in words, if no robot can have made it; else ''."""
    moved, turned = before.distance_to(after), abs(difference(after.yaw, before.yaw))
    at_zero = after.x == after.y == 0.0 and abs(after.yaw) < ZERO_YAW
    if at_zero and (moved > ZERO_PLACE or turned > TURN_BOUND * seconds + SLACK_TURN):
        return SET_TO_ZERO
    if moved > SPEED_BOUND * seconds + SLACK or turned > TURN_BOUND * seconds + SLACK_TURN:
        return f'the odometry jumped by {moved:.2f} m and {math.degrees(turned):.0f} degrees'
    return ''


def _is_backwards(before: Pose2, sample: OdometrySample) -> bool:
    """Does the message show the firmware's fault at +/-180 deg, both spike and displacement?"""
    forward = ((sample.pose.x - before.x) * math.cos(sample.pose.yaw)
               + (sample.pose.y - before.y) * math.sin(sample.pose.yaw))
    return abs(sample.angular) > SPIKE and forward * sample.linear < 0.0


class _Interval:
    """The time for which something has been true, by the stamps of its samples."""

    def __init__(self) -> None:
        self.begin, self.end = math.inf, -math.inf

    def update(self, is_true: bool, stamp: float) -> None:
        """Take in a sample. If the clock goes back, the interval begins again."""
        if not (is_true and self.begin <= stamp):
            self.begin = stamp
        self.end = stamp


class EncoderWatch:
    """Does the odometry contradict the angles of the wheels?

    If the servos do not answer (battery empty, or a cable out), the firmware repeats the last step
    of its encoders: the odometry moves at its last speed for ever, while the robot and the angles
    in `joint_states` stand.

    Stamps are compared, so delays of the network do not matter. Without stamps, or without samples
    of the wheels, nothing is found. In a turn on the spot nothing is found, either: there
    stale_or_stalled finds a robot that does not turn. Source: OpenCR firmware 1.2.6
    (turtlebot3_core.ino): without an answer, calcOdometry() is called without updateMotorInfo().
    """

    def __init__(self) -> None:
        self._wheels: Optional[WheelSample] = None           # the latest
        self._odometry: Optional[OdometrySample] = None
        self._stand, self._rolls = _Interval(), _Interval()

    def on_wheels(self, sample: WheelSample) -> None:
        stands = self._wheels is not None and self._wheels[1:] == sample[1:]
        self._stand.update(stands, sample.stamp)
        self._wheels = sample

    def on_odometry(self, sample: OdometrySample) -> None:
        """Take in a sample of the odometry. A repeated pose is not a motion."""
        rolls = (self._odometry is not None and self._odometry.pose != sample.pose
                 and not is_slow(sample.linear, 0.0))
        self._rolls.update(rolls, sample.stamp)
        self._odometry = sample

    def problem(self) -> str:
        """Returns the contradiction in words; '' if there is none."""
        together = (min(self._stand.end, self._rolls.end)
                    - max(self._stand.begin, self._rolls.begin))
        return SERVOS_SILENT if together > CONTRADICTS else ''
