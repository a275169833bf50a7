"""The odometry without the jumps that are none of the robot's.

Odometry jumps for two reasons although the robot does not:

* When the IMU crosses +/-180 deg, the firmware takes one displacement backwards. Such a message
  contradicts itself: it shows the spike in its rate of turn, and a displacement against its own
  forward speed. That one displacement is turned round again.
* It is set to zero by the robot's own `reset`, or its wheels spin in the hands of somebody who
  carries the robot. Then the robot is taken to stand where it was, turned as the IMU says. Where
  the IMU jumps as well, the board has restarted, and nothing is known any more.

Frames: ``odom`` is the odometry's own, ``steady`` the one in which nothing jumps; they are the same
until the first jump. Units: metres, radians, seconds.
Source: OpenCR firmware 1.2.6 (see :mod:`tb3_labs.simulation.firmware`); a recording of a real Burger shows its
crossing 7.3 mm backwards.
"""
import math
from dataclasses import replace
from typing import NamedTuple

from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2

#: No robot of these is faster, whoever drives it [m/s], [rad/s];
FASTEST = 0.5
FASTEST_TURN = 4.0
#: and messages are not that even [m], [rad].
SLACK = 0.05
SLACK_TURN = 0.3
#: What happened in a silence longer than this, nobody knows [s].
LONGEST = 5.0
#: A rate of turn beyond this is the firmware's spike [rad/s].
SPIKE = 10.0
#: An odometry whose place is exactly zero, and whose yaw is that near to it, was just set to zero,
#: unless it was as near before [rad], [m].
ZERO_YAW = 0.01
ZERO_PLACE = 0.001
#: The board is deaf and dumb while it resets, for seconds; what is first heard after such a silence
#: [s] may have moved a little since [m], [rad].
RESET_SILENCE = 1.0
NEAR_ZERO_PLACE = 0.03
NEAR_ZERO_YAW = 0.1
#: A robot at rest turns no farther than this between two messages, [rad];
RESTING_TURN = 0.1
#: one that turns comes to rest within this time of the last one, as do its commands [s].
STOPPING_TIME = 0.5


class Jump(NamedTuple):
    """What a sensor did that the robot cannot have done, in words, and what becomes of the pose."""

    text: str
    outcome: str = ''


#: Outcomes of a jump of the odometry.
POSE_KEPT = 'the local pose is kept'
POSE_LOST = "the IMU's heading as well: local begins anew at (0, 0, 0), where the robot is now"


class JumpFilter:
    """Takes the messages of one robot in, in order."""

    def __init__(self):
        #: Where ``odom`` stands in ``steady``.
        self.steady_T_odom = Pose2()
        self._last = None         # the sample that last said something new, as it was sent,
        self._arrival = None      # when it arrived,
        self._imu = None          # and the IMU's newest sample then

    def take(self, sample, arrival, imu):
        """(The OdometrySample in ``steady``, the Jump it shows or None).

        `imu`: the newest ImuSample, by which the robot turned while the odometry jumped.
        """
        jump = None
        if self._last is not None:
            what = _jump(self._last.pose, sample.pose, self._seconds(sample, arrival))
            if what:
                jump = self._stand_still(what, sample, imu)
            elif _is_backwards(self._last.pose, sample):
                # what it drove is the other way: twice the step from where it says it is
                place = self.steady_T_odom.act((2.0 * self._last.pose.x - sample.pose.x,
                                                2.0 * self._last.pose.y - sample.pose.y))
                self._hold(Pose2(*place, self.steady_T_odom.yaw + sample.pose.yaw), sample.pose)
        if self._last is None or sample.pose != self._last.pose:
            self._last, self._arrival, self._imu = sample, arrival, imu
        return replace(sample, pose=self.steady_T_odom @ sample.pose), jump

    def _stand_still(self, what, sample, imu):
        turned = difference(imu.yaw, self._imu.yaw)
        if abs(turned) > RESTING_TURN + STOPPING_TIME * abs(self._imu.yaw_rate):
            self.steady_T_odom = Pose2()
            return Jump(what, POSE_LOST)
        here = self.steady_T_odom @ self._last.pose
        self._hold(Pose2(here.x, here.y, here.yaw + turned), sample.pose)
        return Jump(what, POSE_KEPT)

    def _seconds(self, sample, arrival):
        """Since the last sample: by stamps or arrivals, whichever allows for more."""
        by_stamps = sample.stamp - self._last.stamp
        return min(max(by_stamps, arrival - self._arrival, 0.0), LONGEST)

    def _hold(self, steady_T_base, odom_T_base):
        """From now on the pose that is ``odom_T_base`` in odom is that one in steady."""
        self.steady_T_odom = steady_T_base @ odom_T_base.inverse()


def _jump(before, after, seconds):
    """'' or what no robot can have done between two poses."""
    moved, turned = before.distance_to(after), abs(difference(after.yaw, before.yaw))
    at_zero = after.x == after.y == 0.0 and abs(after.yaw) < ZERO_YAW
    if at_zero and (moved > ZERO_PLACE or turned > FASTEST_TURN * seconds + SLACK_TURN):
        return 'the odometry was set to zero'
    near_zero = math.hypot(after.x, after.y) < NEAR_ZERO_PLACE and abs(after.yaw) < NEAR_ZERO_YAW
    if seconds > RESET_SILENCE and near_zero and (
            moved > NEAR_ZERO_PLACE or turned > NEAR_ZERO_YAW):
        return 'the odometry was set to zero'
    if moved > FASTEST * seconds + SLACK or turned > FASTEST_TURN * seconds + SLACK_TURN:
        return 'the odometry jumped by {:.2f} m and {:.0f} degrees'.format(
            moved, math.degrees(turned))
    return ''


def _is_backwards(before, sample):
    """Does the message show the firmware's fault at +/-180 deg: spike and displacement?"""
    forward = ((sample.pose.x - before.x) * math.cos(sample.pose.yaw)
               + (sample.pose.y - before.y) * math.sin(sample.pose.yaw))
    return abs(sample.angular) > SPIKE and forward * sample.linear < 0.0
