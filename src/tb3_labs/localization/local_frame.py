"""The local frame, in which a reset declares the pose of the robot.

In the lab, A is the frame ``odom``, and B is the frame ``local``. The pose of B in A is (t, theta).
The place p_A in frame A is the place ``p_B = R(theta)^-1 (p_A - t)`` in frame B.

A reset uses the odometry's pose and the IMU's yaw at one instant.

1. The odometry computes the place with its own yaw, so theta must also come from the odometry's
   yaw. A theta from the IMU's yaw would turn every displacement by a constant angle.
2. The heading comes from the IMU, relative to the IMU's yaw at the reset.

Units: metres, radians. Source: the Transformation lab's handout. Here a reset may declare any pose,
and the IMU's yaw may differ from the odometry's yaw.
"""
from dataclasses import dataclass

from tb3_labs.geometry.angles import wrap
from tb3_labs.geometry.se2 import Pose2


@dataclass(frozen=True)
class LocalFrame:
    """The pose of ``local`` in ``odom``, and the IMU's yaw when the heading in ``local`` is 0."""

    odom_T_local: Pose2
    imu_yaw_at_zero: float

    @classmethod
    def declare(cls, local_T_base: Pose2, odom_T_base: Pose2, imu_yaw: float) -> 'LocalFrame':
        """Returns the frame in which the robot is at `local_T_base` while its sensors read
        `odom_T_base` and `imu_yaw` [rad]."""
        return cls(odom_T_base @ local_T_base.inverse(), wrap(imu_yaw - local_T_base.yaw))

    def pose(self, odom_T_base: Pose2, imu_yaw: float) -> Pose2:
        """Returns the robot's pose in ``local``."""
        place = self.odom_T_local.inverse() @ odom_T_base
        return Pose2(place.x, place.y, self.heading(imu_yaw))

    def heading(self, imu_yaw: float) -> float:
        """Returns the robot's heading in ``local`` [rad], (-pi, pi]."""
        return wrap(imu_yaw - self.imu_yaw_at_zero)
