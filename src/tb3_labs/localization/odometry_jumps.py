"""Finds faults of the odometry. A jump of the odometry is a step that is not a motion of the robot.

There are three kinds of jumps:

1. When the IMU crosses +/-180 deg, the firmware reverses the displacement in one message. The rate
   of turn in this message has a spike, and the displacement and the speed have opposite directions.
2. A `reset` or restart of the robot's board sets the odometry's place to zero after a silence.
   During the silence the motors keep their speed. If the robot was moving before the silence, the
   pose is lost. Otherwise the robot has not moved, and a turn of the IMU shows a calibration.
3. The odometry jumps without a silence, for example if the wheels spin while the robot is carried.
   The robot is assumed to be at its previous place, with the turn that the IMU shows. If the IMU
   jumps as well, the pose is lost.

A jump moves the frame ``odom``. The *shift* is the pose of the old ``odom`` in the new ``odom``.
Each pose in ``odom`` must be multiplied by the shift.

Units: metres, radians, seconds. Source: OpenCR firmware 1.2.6 (see
:mod:`tb3_labs.simulation.firmware`). A `reset` takes 2.6 s. After a `reset`, the odometry's yaw is
the turn of the IMU in these 2.6 s. In a recording of a Burger, a reversed displacement is 7.3 mm.
"""
import math
from typing import NamedTuple, Optional, Tuple

from tb3_labs.geometry.angles import clamp, difference
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.localization.sample_timing import TimedSample
from tb3_labs.robot.samples import (
    MAX_REST_SPEED, ImuSample, OdometrySample, WheelSample, is_at_rest)
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT
from tb3_labs.supervision.timeouts import LONGEST_COUNTED_SILENCE, RESET_SILENCE

MAX_POSSIBLE_SPEED = 0.5    # [m/s]; no TurtleBot3 drives faster
MAX_TURN_RATE = 4.0         # [rad/s]; no TurtleBot3 turns faster
#: Messages arrive unevenly, so these are added to the longest possible step [m, rad].
DISTANCE_SLACK = 0.05
TURN_SLACK = 0.3
MIN_SPIKE_RATE = 10.0         # [rad/s]; a faster rate in an odometry message is a spike
MIN_RESET_DISTANCE = 0.001    # a step to zero is a reset only if it begins this far [m] from zero
#: The robot may move, so its first place after a reset may be this far [m] from zero.
NEAR_ZERO_DISTANCE = 0.03
#: The first yaw after a reset differs by at most this [rad] from zero, or from the IMU's turn.
NEAR_ZERO_YAW = 0.1
MAX_RESTING_TURN = 0.1    # [rad]; greatest turn of the IMU between two messages of a robot at rest
#: If the IMU turns farther than this [rad] in a silence, the board has calibrated the IMU.
MIN_CALIBRATION_TURN = 0.005
STOPPING_TIME = 0.5    # [s]; a turning robot comes to rest within this time after its last message
#: The odometry contradicts the wheels if it moves for this time [s] while the wheels rest.
CONTRADICTION_TIME = 0.5
SERVOS_SILENT = ('the odometry runs on but the wheels stand: the servos do not answer (battery '
                 'empty? a cable out?); switch the robot off and on')
SET_TO_ZERO = 'the odometry was set to zero'
#: A jump of the odometry has one of these outcomes.
POSE_KEPT = 'the local pose is kept'
POSE_LOST = 'pose lost: reset_pose, or place the robot and reset'


class Jump(NamedTuple):
    """A step in the values of a sensor that no motion of the robot explains."""

    text: str                 # text for the user about the step, or ''
    outcome: str = ''         # POSE_KEPT, POSE_LOST or ''
    shift: Pose2 = Pose2()    # pose of the old ``odom`` in the new ``odom``
    imu_turn: float = 0.0     # turn [rad] of the IMU that the robot did not make


class _OdometryMessage(NamedTuple):
    """An odometry message, and the latest sample of the IMU when the message arrived."""

    sample: OdometrySample
    arrival: float
    imu: ImuSample

    @property
    def shows_rest(self) -> bool:
        return is_at_rest(self.sample.linear, self.imu.yaw_rate)

    def shortest_gap(self, earlier: '_OdometryMessage') -> float:
        """Returns the time [s] since `earlier`, by stamps or by arrivals, whichever is shorter. A
        delay, or a clock that is set, cannot make the shortest gap longer."""
        stamp_interval, arrival_interval = self._intervals_since(earlier)
        return min(stamp_interval, arrival_interval) if stamp_interval > 0.0 else arrival_interval

    def longest_gap(self, earlier: '_OdometryMessage') -> float:
        """Returns the time [s] since `earlier`, by stamps or by arrivals, whichever is longer,
        clipped to [0, LONGEST_COUNTED_SILENCE]."""
        return clamp(max(self._intervals_since(earlier)), 0.0, LONGEST_COUNTED_SILENCE)

    def _intervals_since(self, earlier: '_OdometryMessage') -> Tuple[float, float]:
        return self.sample.stamp - earlier.sample.stamp, self.arrival - earlier.arrival


class JumpFinder:
    def __init__(self) -> None:
        self._last_move: Optional[_OdometryMessage] = None    # the latest message with a new pose
        self._latest: Optional[_OdometryMessage] = None

    def find(self, timed: TimedSample, imu: ImuSample,
             commanded_at: float = -math.inf) -> Optional[Jump]:
        """Returns the jump of an odometry message, or None. `imu` is the latest ImuSample. The
        latest known command to move was sent at `commanded_at` [s, receiver's clock]."""
        latest = _OdometryMessage(timed.sample, timed.arrival, imu)
        previous = self._latest
        last_move = self._last_move
        self._latest = latest
        if last_move is None or latest.sample.pose != last_move.sample.pose:
            self._last_move = latest
        if last_move is None or previous is None:
            return None

        if _is_reset(previous, latest):
            return _jump_of_reset(previous, latest, commanded_at)
        old_pose, new_pose = last_move.sample.pose, latest.sample.pose
        problem = _displacement_problem(old_pose, new_pose, latest.longest_gap(last_move))
        if problem:
            return _jump_at_rest(problem, last_move, latest)
        if _is_backwards(old_pose, latest.sample):
            return Jump('', shift=_shift(_true_pose(old_pose, new_pose), new_pose))
        return None


def _is_reset(earlier: _OdometryMessage, later: _OdometryMessage) -> bool:
    """Returns True if the board was reset or restarted between two messages."""
    if later.shortest_gap(earlier) <= RESET_SILENCE:
        return False
    old_pose, new_pose = earlier.sample.pose, later.sample.pose
    imu_turn = difference(later.imu.yaw, earlier.imu.yaw)
    is_zero = _is_at_zero(new_pose)
    if not (is_zero or _is_near_zero(new_pose, imu_turn)):
        return False
    if old_pose.distance_to(new_pose) > NEAR_ZERO_DISTANCE:
        return True
    # the place was near zero before the silence, so only the yaws can show a reset
    contradicts_imu = abs(difference(new_pose.yaw - old_pose.yaw, imu_turn)) > NEAR_ZERO_YAW
    is_calibrated = abs(imu_turn) > MIN_CALIBRATION_TURN and earlier.shows_rest
    return contradicts_imu or (is_zero and is_calibrated)


def _is_at_zero(pose: Pose2) -> bool:
    return pose.x == 0.0 and pose.y == 0.0


def _is_near_zero(pose: Pose2, imu_turn: float) -> bool:
    """Returns True if a robot may have this pose just after a reset of its board."""
    if math.hypot(pose.x, pose.y) > NEAR_ZERO_DISTANCE:
        return False
    is_yaw_zero = abs(pose.yaw) <= NEAR_ZERO_YAW    # the reset also sets the IMU's yaw to zero
    is_yaw_the_turn = abs(difference(pose.yaw, imu_turn)) <= NEAR_ZERO_YAW
    return is_yaw_zero or is_yaw_the_turn


def _jump_of_reset(earlier: _OdometryMessage, later: _OdometryMessage, commanded_at: float) -> Jump:
    imu_turn = difference(later.imu.yaw, earlier.imu.yaw)
    was_moving = not earlier.shows_rest or commanded_at >= earlier.arrival - COMMAND_TIMEOUT
    was_carried = abs(imu_turn) > MAX_RESTING_TURN
    is_long = later.longest_gap(earlier) >= LONGEST_COUNTED_SILENCE
    if was_moving or was_carried or is_long:
        return Jump(SET_TO_ZERO, POSE_LOST)
    return Jump(SET_TO_ZERO, POSE_KEPT, _shift(earlier.sample.pose, later.sample.pose), imu_turn)


def _jump_at_rest(problem: str, earlier: _OdometryMessage, later: _OdometryMessage) -> Jump:
    """Returns the jump of a robot that has not moved since the message `earlier`."""
    imu_turn = difference(later.imu.yaw, earlier.imu.yaw)
    if abs(imu_turn) > MAX_RESTING_TURN + STOPPING_TIME * abs(earlier.imu.yaw_rate):
        return Jump(problem, POSE_LOST)
    old_pose = earlier.sample.pose
    turned_pose = Pose2(old_pose.x, old_pose.y, old_pose.yaw + imu_turn)
    return Jump(problem, POSE_KEPT, _shift(turned_pose, later.sample.pose))


def _shift(old_pose: Pose2, new_pose: Pose2) -> Pose2:
    """Returns the shift of ``odom`` for a robot that is at `old_pose` in the old ``odom``, and at
    `new_pose` in the new ``odom``."""
    return new_pose @ old_pose.inverse()


def _displacement_problem(old_pose: Pose2, new_pose: Pose2, seconds: float) -> str:
    """Returns a text about a step that no robot can make in `seconds` [s], or ''."""
    distance = old_pose.distance_to(new_pose)
    turn = abs(difference(new_pose.yaw, old_pose.yaw))
    moved_too_far = distance > MAX_POSSIBLE_SPEED * seconds + DISTANCE_SLACK
    turned_too_far = turn > MAX_TURN_RATE * seconds + TURN_SLACK
    if _is_at_zero(new_pose) and (distance > MIN_RESET_DISTANCE or turned_too_far):
        return SET_TO_ZERO
    if moved_too_far or turned_too_far:
        return f'the odometry jumped by {distance:.2f} m and {math.degrees(turn):.0f} degrees'
    return ''


def _true_pose(old_pose: Pose2, reversed_pose: Pose2) -> Pose2:
    """Returns the robot's pose. The firmware has reversed the sign of the displacement, so the true
    place is the old place minus the reversed displacement."""
    return Pose2(2.0 * old_pose.x - reversed_pose.x, 2.0 * old_pose.y - reversed_pose.y,
                 reversed_pose.yaw)


def _is_backwards(old_pose: Pose2, sample: OdometrySample) -> bool:
    """Returns True if the firmware has reversed the displacement from `old_pose`."""
    forward = ((sample.pose.x - old_pose.x) * math.cos(sample.pose.yaw)
               + (sample.pose.y - old_pose.y) * math.sin(sample.pose.yaw))
    return abs(sample.angular) > MIN_SPIKE_RATE and forward * sample.linear < 0.0


class EncoderMonitor:
    """Finds a contradiction between the odometry and the angles of the wheels.

    If the servos do not answer (battery empty, or a cable out), the firmware repeats the last step
    of its encoders. Then the odometry moves for ever, although the robot is at rest and the angles
    of the wheels in `joint_states` do not change. Only stamps are compared, so delays of the
    network do not matter. Source: OpenCR firmware 1.2.6, which calls calcOdometry() without
    updateMotorInfo() if the servos do not answer (turtlebot3_core.ino).
    """

    def __init__(self) -> None:
        self._wheels: Optional[WheelSample] = None           # the latest sample
        self._odometry: Optional[OdometrySample] = None      # the latest sample
        self._rest_since = math.inf     # the wheels' angles have not changed since this stamp
        self._moves_since = math.inf    # the odometry has moved since this stamp

    def on_wheels(self, sample: WheelSample) -> None:
        last = self._wheels
        is_resting = last is not None and (sample.left, sample.right) == (last.left, last.right)
        if not is_resting or sample.stamp < self._rest_since:    # the clock may go back
            self._rest_since = sample.stamp
        self._wheels = sample

    def on_odometry(self, sample: OdometrySample) -> None:
        is_new_pose = self._odometry is not None and self._odometry.pose != sample.pose
        is_moving = is_new_pose and abs(sample.linear) > MAX_REST_SPEED
        if not is_moving or sample.stamp < self._moves_since:
            self._moves_since = sample.stamp
        self._odometry = sample

    def problem_text(self) -> str:
        """Returns SERVOS_SILENT, or ''."""
        if self._wheels is None or self._odometry is None:
            return ''
        begin = max(self._rest_since, self._moves_since)
        end = min(self._wheels.stamp, self._odometry.stamp)
        return SERVOS_SILENT if end - begin > CONTRADICTION_TIME else ''
