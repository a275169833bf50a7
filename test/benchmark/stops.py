"""The end of a motion in which something fails: roll-outs on the embedded robot.

In each state of a drive, and in a turn, a fault begins. A Stop has the times until the core commands
zero and until the robot truly stands, and the robot's true motion.

Units: seconds, metres, radians.
"""
import math
from dataclasses import dataclass, replace

from rollout import control, moved, navigation, run

from tb3_labs.control.drive_law import DriveConfig, DriveLaw
from tb3_labs.geometry.angles import unwrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.nodes.controller.core import ControllerCore
from tb3_labs.nodes.controller.turns import TurnConfig, make_turn_law
from tb3_labs.nodes.move_to_goal.core import MoveToGoalCore
from tb3_labs.robot.turtlebot3 import Twist2, robot_model
from tb3_labs.simulation.simulator import Simulator
from tb3_labs.simulation.simulator_config import SimulatorConfig

#: A drive to this goal has three parts, and each is long enough for a fault.
GOAL = Pose2(-0.9, 0.675, 0.0)
#: A robot with the delays of a lab's network.
ROBOT = SimulatorConfig(imu_offset_deg=140.6, command_latency=0.02, sensor_latency=0.01)
#: The fault begins this time after the begin of the state, when the robot has its full speed [s].
FULL_MOTION = 0.7
#: Longest wait for a stop [s].
STOP_TIMEOUT = 3.2
#: A robot that has rested for this long [s] after a zero stays at rest.
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
    """Returns the Stop of a drive to GOAL. `fault(robot)` begins a fault during a GoalState."""
    robot = Simulator(robot_config)
    navigator = MoveToGoalCore(DriveLaw(drive_config, robot_model(robot_config.model)), True)
    hear = navigation(robot, navigator)
    run(robot, navigator, hear, 0.5)
    navigator.set_goal(GOAL)
    while navigator.status(robot.now).state is not state:
        run(robot, navigator, hear, STEP)

    def reason():
        status = navigator.status(robot.now)
        return status.failure or status.reason_to_stand
    return _stop(robot, navigator, hear, fault, reason)


def stop_of_a_turn(fault, robot_config=ROBOT, turn_config=TurnConfig(), degrees=180.0):
    """Returns the Stop of a turn, during which `fault(robot)` begins a fault."""
    robot = Simulator(robot_config)
    controller = ControllerCore(make_turn_law(turn_config, robot_model(robot_config.model)))
    hear = control(robot, controller)
    run(robot, controller, hear, 0.5)
    controller.request_turn(degrees, robot.now)
    log_lines = []

    def reason():
        return '; '.join(line.text for line in log_lines if line.is_warning)
    return _stop(robot, controller, hear, fault, reason, log_lines)


def setting(**changes):
    """Returns a fault that changes the robot's settings."""
    return lambda robot: robot.configure(replace(robot.config, **changes))


def _stop(robot, driver, hear, fault, reason, log_lines=None):
    run(robot, driver, hear, FULL_MOTION)
    fault(robot)
    begun = moved_at = robot.now
    last, yaw = robot.truth, robot.truth.yaw
    zero_at = None
    way = turn = 0.0
    zero_reason = ''
    while robot.now - begun < STOP_TIMEOUT and (
            zero_at is None or robot.now - max(zero_at, moved_at) < SETTLED_TIME):
        commands = run(robot, driver, hear, STEP, log_lines)
        if zero_at is None and ZERO in commands:
            zero_at = robot.now
            zero_reason = reason()
        here = robot.truth
        now_yaw = unwrap(here.yaw, yaw)
        if moved(last, here, STEP):
            moved_at = robot.now
        way += last.distance_to(here)
        turn += abs(now_yaw - yaw)
        last, yaw = here, now_yaw
    if zero_at is None:
        zero_at = math.inf
    return Stop(reason=zero_reason or reason(), to_zero=zero_at - begun,
                to_rest=moved_at - begun, way=way, turn=turn)
