"""Resets of a robot that spins because another node drives it.

Units: seconds, metres, radians.
"""
import math
import random

from rollout import navigation, run

from tb3_labs.control.driving import make_law
from tb3_labs.control.goal import DriveConfig
from tb3_labs.control.motor_response import Response
from tb3_labs.control.speed_laws import Twist2
from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.nodes.move_to_goal import MoveToGoalCore
from tb3_labs.robot.turtlebot3 import robot_model
from tb3_labs.simulation.simulator import Simulator

#: Time from one command to the next.
PERIOD = 0.1
STEP = 0.02


class OtherNode:
    """Commands one rate of turn again and again; the navigator hears it."""

    def __init__(self, navigator):
        self._navigator = navigator
        self._next = 0.0
        self.rate = 0.0

    def due(self, now):
        return now >= self._next

    def command(self, now):
        self._next = now + PERIOD
        self._navigator.heard_command(0.0, self.rate, now)
        return Twist2(0.0, self.rate)


def reset_in_a_spin(robot_config, rate=1.0, spins_before=0):
    """Angle by which the pose is off after a reset at `rate`; in some spins before, nothing is
    reset."""
    rng = random.Random(robot_config.seed)
    robot, model, response = Simulator(robot_config), robot_model(robot_config.model), Response()
    navigator = MoveToGoalCore(make_law(DriveConfig(), model, response), response=response)
    node, hear = OtherNode(navigator), navigation(robot, navigator)

    def spin(at, seconds):
        node.rate = at
        run(robot, node, hear, seconds)

    for _ in range(spins_before):
        spin(0.0, 1.0 + rng.random())
        spin(rate, 1.5)
    spin(0.0, 1.0 + rng.random())
    spin(rate, 1.0 + rng.random())
    while navigator.status(robot.now).sensor_problem:    # the network stalls
        spin(rate, STEP)
    there, reset = robot.truth, navigator.reset(Pose2(), robot.now)
    while not reset.done:
        spin(rate, STEP)
    spin(0.0, 1.5)
    return abs(difference(navigator.pose(robot.now).yaw, (there.inverse() @ robot.truth).yaw))


def miss(angle, goal):
    """Distance by which a goal is missed after a reset that was off by `angle`."""
    return 2.0 * math.sin(0.5 * angle) * Pose2().distance_to(goal)
