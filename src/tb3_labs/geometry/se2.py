"""Poses in the plane, and points that they transform, as in the handout.

A pose ``A_T_B`` is the place of frame B in frame A. It transforms a point p_B in B to A,

    p_A = R(theta) p_B + t            (``A_T_B.act(p_B)``)

and the way back is ``p_B = R(theta)^-1 (p_A - t)`` (``A_T_B.inverse().act(p_A)``).
Poses chain by the names of their frames, so ``A_T_B @ B_T_C`` is ``A_T_C``.

Units: metres and radians. A computed yaw is in (-pi, pi]. Sources: the Transformation lab's
handout. The names, such as A_T_B, are those of the Sophus library.
"""
import math
from dataclasses import dataclass
from typing import Sequence, Union

import numpy as np

from tb3_labs.geometry.angles import interpolate_angle, wrap


def rotation_matrix(theta: float) -> np.ndarray:
    """Returns R(theta), shape (2, 2), which turns a point by `theta` counter-clockwise."""
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
        """Transform `points`, shape (..., 2) [m], from this pose's own frame to its parent."""
        return np.asarray(points, dtype=float) @ rotation_matrix(self.yaw).T + (self.x, self.y)

    def inverse(self) -> 'Pose2':
        """Returns the inverse pose: the parent frame, seen from this pose."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return Pose2(-cos * self.x - sin * self.y, sin * self.x - cos * self.y, wrap(-self.yaw))

    def __matmul__(self, other: 'Pose2') -> 'Pose2':
        """Returns A_T_B @ B_T_C = A_T_C."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return Pose2(self.x + cos * other.x - sin * other.y,
                     self.y + sin * other.x + cos * other.y,
                     wrap(self.yaw + other.yaw))

    def distance_to(self, other: 'Pose2') -> float:
        """Returns the straight-line distance between the two places [m]."""
        return math.hypot(other.x - self.x, other.y - self.y)

    def bearing_to(self, other: 'Pose2') -> float:
        """Returns the direction of `other` from here, in the parent frame [rad], (-pi, pi]."""
        return wrap(math.atan2(other.y - self.y, other.x - self.x))

    def __str__(self) -> str:
        return f'x={self.x:.3f}, y={self.y:.3f}, yaw={math.degrees(self.yaw):.1f} deg'


def interpolate(start: Pose2, end: Pose2, fraction: float) -> Pose2:
    """Returns the pose at a `fraction` (0 to 1) of the way. Its yaw turns the short way round."""
    return Pose2(start.x + fraction * (end.x - start.x),
                 start.y + fraction * (end.y - start.y),
                 interpolate_angle(start.yaw, end.yaw, fraction))
