"""The end of a motion in which something fails: roll-outs on the embedded robot.

In each state of a drive, and in a turn, a fault begins. Measured are the time at which the core
commands zero, the time at which the robot truly stands, and its true motion until then.

Units: seconds, metres, radians.
"""
import math
from dataclasses import dataclass, replace

from rollout import control, moved, navigation, run

from tb3_labs.control.drive_law import DriveConfig, DriveLaw
from tb3_labs.geometry.angles import unwrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.nodes.controller.core import ControllerCore
from tb3_labs.nodes.controller.turns import TurnConfig, make_turn
from tb3_labs.nodes.move_to_goal.core import MoveToGoalCore
from tb3_labs.robot.turtlebot3 import Twist2, robot_model
from tb3_labs.simulation.simulator import Simulator
from tb3_labs.simulation.simulator_config import SimulatorConfig

#: The goal of a drive with three parts, each long enough for an interruption.
GOAL = Pose2(-0.9, 0.675, 0.0)
#: A robot with the delays of a lab's network.
ROBOT = SimulatorConfig(imu_offset_deg=140.6, command_latency=0.02, sensor_latency=0.01)
#: The fault begins this long after the state has begun: in full motion [s].
FULL_MOTION = 0.7
#: Nobody waits longer than this for a stop [s].
PATIENCE = 3.2
#: A robot that has rested for this long after a zero stays at rest [s].
SETTLED_TIME = 1.0
STEP = 0.01
ZERO = Twist2()


@dataclass(frozen=True)
class Stop:
    """The stop after a fault."""

    reason: str        # given by the core
    to_zero: float     # time from the fault to the first zero
    to_rest: float     # time from the fault to the last true motion
    way: float         # length of the path since the fault
    turn: float        # angle turned since the fault, in both directions


def stop_of_a_drive(state, fault, robot_config=ROBOT, drive_config=DriveConfig()):
    """Stop of a drive to GOAL: `fault` (robot -> None) begins during a GoalState."""
    robot = Simulator(robot_config)
    navigator = MoveToGoalCore(DriveLaw(drive_config, robot_model(robot_config.model)), True)
    hear = navigation(robot, navigator)
    run(robot, navigator, hear, 0.5)
    navigator.set_goal(GOAL)
    while navigator.status(robot.now).state is not state:
        run(robot, navigator, hear, STEP)

    def reason():
        status = navigator.status(robot.now)
        return status.failure or status.hold_reason
    return _stop(robot, navigator, hear, fault, reason)


def stop_of_a_turn(fault, robot_config=ROBOT, turn_config=TurnConfig(), degrees=180.0):
    """Stop of a turn during which `fault` (robot -> None) begins."""
    robot = Simulator(robot_config)
    controller = ControllerCore(make_turn(turn_config, robot_model(robot_config.model)))
    hear = control(robot, controller)
    run(robot, controller, hear, 0.5)
    controller.request_turn(degrees, robot.now)
    told = []
    return _stop(robot, controller, hear, fault, lambda: '; '.join(
        line.text for line in told if line.warning), told)


def setting(**changes):
    """A fault that is a change of the robot's settings."""
    return lambda robot: robot.configure(replace(robot.config, **changes))


def _stop(robot, driver, hear, fault, reason, log_lines=None):
    run(robot, driver, hear, FULL_MOTION)
    fault(robot)
    begun = moved_at = robot.now
    last, yaw = robot.truth, robot.truth.yaw
    zero_at, way, turn, said = None, 0.0, 0.0, ''
    while robot.now - begun < PATIENCE and (
            zero_at is None or robot.now - max(zero_at, moved_at) < SETTLED_TIME):
        commands = run(robot, driver, hear, STEP, log_lines)
        if zero_at is None and ZERO in commands:
            zero_at, said = robot.now, reason()
        here = robot.truth
        now_yaw = unwrap(here.yaw, yaw)
        if moved(last, here, STEP):
            moved_at = robot.now
        way += last.distance_to(here)
        turn += abs(now_yaw - yaw)
        last, yaw = here, now_yaw
    return Stop(said or reason(), math.inf if zero_at is None else zero_at - begun,
                moved_at - begun, way, turn)
