"""The least time that a drive can take, for comparison in the benchmark and the report.

Units: metres, radians, seconds. Source: Balkcom and Mason, Time optimal trajectories for bounded
velocity differential drive vehicles (2002).
"""
import math

from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.turtlebot3 import RobotModel


def least_time(start: Pose2, goal: Pose2, model: RobotModel, max_linear: float = math.inf,
               max_angular: float = math.inf, reverse: bool = False) -> float:
    """Least time [s] from pose to pose by a turn, a straight line and a turn.

    Where the wheels are the only limit (Balkcom and Mason, 2002), it is
    (b (|turn1| + |turn2|) + distance) / V, with b half the track and V a wheel's speed. The limits
    `max_linear` [m/s] and `max_angular` [rad/s] can make it longer.
    """
    linear = min(max_linear, model.max_linear)
    angular = min(max_angular, model.max_angular)
    line = start.bearing_to(goal)
    times = []
    for face in (line, line + math.pi) if reverse else (line,):
        turned = abs(difference(face, start.yaw)) + abs(difference(goal.yaw, face))
        times.append(turned / angular + start.distance_to(goal) / linear)
    return min(times)
