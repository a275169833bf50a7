"""The least time of a drive from pose to pose: the measure of a drive's time.

Units: metres, radians, seconds.
"""
import math

from tb3_labs.control.goal_state import turned
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.turtlebot3 import RobotModel


def least_time(start: Pose2, goal: Pose2, model: RobotModel, max_linear: float = math.inf,
               max_angular: float = math.inf, reverse: bool = False) -> float:
    """Least time [s] from pose to pose by a turn, a straight line and a turn.

    If the wheels are the only limit, this time is (Balkcom and Mason, Time optimal trajectories for
    bounded velocity differential drive vehicles, 2002)
    (b (|turn1| + |turn2|) + distance) / V, with b half the track and V a wheel's speed. The limits
    `max_linear` [m/s] and `max_angular` [rad/s] can make the time longer.
    """
    linear = min(max_linear, model.max_linear)
    angular = min(max_angular, model.max_angular)
    line = start.bearing_to(goal)
    times = []
    for face in (line, line + math.pi) if reverse else (line,):
        times.append(turned(start.yaw, face, goal.yaw) / angular
                     + start.distance_to(goal) / linear)
    return min(times)
