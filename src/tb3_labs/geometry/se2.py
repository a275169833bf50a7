"""Poses in the plane, which transform points as in the handout.

The pose ``A_T_B`` is the place and the heading of frame B in frame A. It transforms the point
p_B in frame B to the point p_A in frame A. The inverse pose transforms p_A back to p_B:

    p_A = R(theta) p_B + t            (``A_T_B.act(p_B)``)
    p_B = R(theta)^-1 (p_A - t)       (``A_T_B.inverse().act(p_A)``)

The product of two poses is a pose: ``A_T_B @ B_T_C`` is ``A_T_C``.

Units: metres and radians. A computed yaw is in (-pi, pi]. Source: the Transformation lab's handout.
Names such as A_T_B are written as in the Sophus library.
"""
import math
from dataclasses import dataclass
from typing import Sequence, Union

import numpy as np

from tb3_labs.geometry.angles import interpolate_angle, wrap


def rotation_matrix(theta: float) -> np.ndarray:
    """Returns R(theta), the (2, 2) matrix that turns a point by `theta` counter-clockwise."""
    cos, sin = math.cos(theta), math.sin(theta)
    return np.array([[cos, -sin],
                     [sin, cos]])


@dataclass(frozen=True)
class Pose2:
    """A place and a heading in the plane."""

    x: float = 0.0      # [m]
    y: float = 0.0      # [m]
    yaw: float = 0.0    # [rad]

    def act(self, points: Union[np.ndarray, Sequence]) -> np.ndarray:
        """Transform `points` [m], shape (..., 2), from this pose's frame to the parent frame."""
        return np.asarray(points, dtype=float) @ rotation_matrix(self.yaw).T + (self.x, self.y)

    def inverse(self) -> 'Pose2':
        """Returns the pose of the parent frame in the frame of this pose."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return Pose2(-cos * self.x - sin * self.y, sin * self.x - cos * self.y, wrap(-self.yaw))

    def __matmul__(self, other: 'Pose2') -> 'Pose2':
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return Pose2(self.x + cos * other.x - sin * other.y,
                     self.y + sin * other.x + cos * other.y,
                     wrap(self.yaw + other.yaw))

    def distance_to(self, other: 'Pose2') -> float:
        """Returns the straight distance [m] between the places of both poses."""
        return math.hypot(other.x - self.x, other.y - self.y)

    def bearing_to(self, other: 'Pose2') -> float:
        """Returns the direction [rad], (-pi, pi], from this pose to `other` in the parent frame."""
        return wrap(math.atan2(other.y - self.y, other.x - self.x))

    def __str__(self) -> str:
        return f'x={self.x:.3f}, y={self.y:.3f}, yaw={math.degrees(self.yaw):.1f} deg'


def interpolate(start: Pose2, end: Pose2, fraction: float) -> Pose2:
    """Returns the pose at a `fraction` (0 to 1) of the way. The yaw turns the short way round."""
    return Pose2(start.x + fraction * (end.x - start.x),
                 start.y + fraction * (end.y - start.y),
                 interpolate_angle(start.yaw, end.yaw, fraction))
