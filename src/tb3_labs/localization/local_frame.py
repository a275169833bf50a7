"""The local frame, in which a reset declares the pose of the robot.

The lab calls the frame ``odom`` A, and the frame ``local`` B. The pose of B in A is (t, theta).
A place p_A in A is the place ``p_B = R(theta)^-1 (p_A - t)`` in B.

A reset declares the robot's present pose in local. The reset uses the odometry's pose and the IMU's
yaw at one instant:

* The place comes from the odometry. So theta comes from the *odometry's* yaw. The IMU's yaw differs
  from the odometry's yaw by a constant angle, and would turn every displacement by this angle.
* The heading comes from the IMU, relative to the IMU's yaw of that instant.

Units: metres, radians. Source: the Transformation lab's handout, corrected for declared poses that
are not zero, and for an IMU and an odometry that disagree.
"""
from dataclasses import dataclass

from tb3_labs.geometry.angles import wrap
from tb3_labs.geometry.se2 import Pose2


@dataclass(frozen=True)
class LocalFrame:
    """The pose of ``local`` in ``odom``, and the IMU's yaw along the x axis of ``local``."""

    odom_T_local: Pose2
    imu_yaw_of_x: float

    @classmethod
    def declare(cls, local_T_base: Pose2, odom_T_base: Pose2, imu_yaw: float) -> 'LocalFrame':
        """Returns the frame in which the robot is at `local_T_base` while its sensors read
        `odom_T_base` and `imu_yaw` [rad]."""
        return cls(odom_T_base @ local_T_base.inverse(), wrap(imu_yaw - local_T_base.yaw))

    def pose(self, odom_T_base: Pose2, imu_yaw: float) -> Pose2:
        """Returns the robot's pose in ``local``: place by odometry, heading by IMU."""
        place = self.odom_T_local.inverse() @ odom_T_base
        return Pose2(place.x, place.y, self.heading(imu_yaw))

    def heading(self, imu_yaw: float) -> float:
        """Returns the robot's heading in ``local`` [rad], (-pi, pi]."""
        return wrap(imu_yaw - self.imu_yaw_of_x)
