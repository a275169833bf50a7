"""The local frame: where the robot is, counted from where it was last declared to be.

Theory of the lab: A is the odometry's frame ``odom``, B the frame ``local``; a place p_A is seen
in B as ``p_B = R(theta)^-1 (p_A - t)``, where (t, theta) is where B stands in A.

A reset declares "the robot is *here*, now, in local". From one instant it takes the odometry's
pose and the IMU's yaw:

* the place comes from the odometry, so B stands in A turned by the *odometry's* yaw of that
  instant (the IMU's zero direction is another one, by any constant, and would throw every
  displacement off by it);
* the heading comes from the IMU, counted from the IMU's yaw of that instant.

Units: metres, radians. Source: the Transformation lab's handout, made right for declared poses
that are not zero and for IMU and odometry that disagree.
"""
from dataclasses import dataclass

from tb3_labs.geometry.angles import wrap
from tb3_labs.geometry.se2 import Pose2


@dataclass(frozen=True)
class LocalFrame:
    """Where ``local`` stands in ``odom``, and which IMU yaw looks along its x axis."""

    odom_T_local: Pose2
    imu_yaw_of_x: float

    @classmethod
    def declared(cls, local_T_base: Pose2, odom_T_base: Pose2, imu_yaw: float) -> 'LocalFrame':
        """The frame in which the robot is at `local_T_base` while its sensors read the others."""
        return cls(odom_T_base @ local_T_base.inverse(), wrap(imu_yaw - local_T_base.yaw))

    @property
    def imu_minus_odometry(self) -> float:
        """The IMU's yaw minus the odometry's when this frame was declared [rad]."""
        return wrap(self.imu_yaw_of_x - self.odom_T_local.yaw)

    def pose(self, odom_T_base: Pose2, imu_yaw: float) -> Pose2:
        """The robot's pose in ``local``: place by odometry, heading by IMU."""
        place = self.odom_T_local.inverse() @ odom_T_base
        return Pose2(place.x, place.y, self.heading(imu_yaw))

    def heading(self, imu_yaw: float) -> float:
        """The robot's heading in ``local`` [rad], (-pi, pi]."""
        return wrap(imu_yaw - self.imu_yaw_of_x)
