"""A pose in the local frame as people type it: in metres and degrees, and within reason.

Source: none; the bounds only catch errors of the unit.
"""
import math
from dataclasses import dataclass

from tb3_labs.config import Config, setting
from tb3_labs.geometry.angles import wrap
from tb3_labs.geometry.se2 import Pose2

#: A place farther than this from the local origin is refused, most likely an error of the unit [m].
MAX_DISTANCE = 100.0
#: So is a heading of more than a whole turn [deg].
MAX_YAW_DEG = 360.0


@dataclass(frozen=True)
class TypedPose(Config):
    """A pose in the local frame in the numbers that a person types."""

    x: float = setting(0.0, 'in the local frame', 'm', -MAX_DISTANCE, MAX_DISTANCE)
    y: float = setting(0.0, 'in the local frame', 'm', -MAX_DISTANCE, MAX_DISTANCE)
    yaw_deg: float = setting(0.0, 'heading', 'deg', -MAX_YAW_DEG, MAX_YAW_DEG)

    @property
    def pose(self) -> Pose2:
        """The same as a Pose2."""
        return Pose2(self.x, self.y, wrap(math.radians(self.yaw_deg)))


def check_pose(pose: Pose2) -> None:
    """``ValueError`` for a Pose2 that is too far, in the words of a TypedPose."""
    TypedPose(float(pose.x), float(pose.y))     # numpy's numbers are no Python numbers
