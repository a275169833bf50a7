"""The way that a robot has driven, thinned and bounded: for a page that comes later."""
from typing import List, Tuple

from tb3_labs.geometry.se2 import Pose2

#: A point is added after this distance [m].
STEP = 0.02
#: With more points than this every other one is dropped.
MOST_POINTS = 1000

Point = Tuple[float, float]


class Trail:
    """The points of one way, in one frame [m]."""

    def __init__(self) -> None:
        self.points: List[Point] = []

    def add(self, pose: Pose2) -> None:
        """The robot is there now."""
        if self.points:
            x, y = self.points[-1]
            if pose.distance_to(Pose2(x, y)) < STEP:
                return
        self.points.append((round(pose.x, 3), round(pose.y, 3)))
        self._thin()

    def begin_with(self, points: List[Point]) -> None:
        """What was driven before goes before the points so far."""
        self.points = [(round(x, 3), round(y, 3)) for x, y in points] + self.points
        self._thin()

    def clear(self) -> None:
        """Forget everything: the frame was declared anew."""
        self.points = []

    def _thin(self) -> None:
        while len(self.points) > MOST_POINTS:
            self.points = self.points[::2]
