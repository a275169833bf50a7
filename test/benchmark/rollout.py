"""One motion from start to rest, in pure Python: a node's core on the embedded robot.

A roll-out is faster than real time by orders of magnitude. Benchmarks and tests judge motions by
the robot's true pose, and never by the core's estimate.

Units: seconds, metres, radians.
"""
import math
from dataclasses import dataclass
from typing import Callable, List, Optional, Sequence, Union

from tb3_labs.control.drive_law import DriveConfig, DriveLaw, sum_of_turns
from tb3_labs.control.goal_state import GoalState
from tb3_labs.control.motor_response import MotorResponse
from tb3_labs.geometry.angles import difference, unwrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.localization.localizer import Reset
from tb3_labs.nodes.controller.core import ControllerCore
from tb3_labs.nodes.controller.turns import Driver, TurnConfig, make_turn_law
from tb3_labs.nodes.move_to_goal.core import MoveToGoalCore
from tb3_labs.robot.samples import MAX_REST_SPEED, MAX_REST_TURN_RATE, ImuSample, Sample
from tb3_labs.robot.turtlebot3 import RobotModel, Twist2, robot_model
from tb3_labs.simulation.simulator import Simulator
from tb3_labs.simulation.simulator_config import SimulatorConfig
from tb3_labs.supervision.events import LogLine
from tb3_labs.supervision.goal_requests import RequestedPose

#: Time between two looks at the robot's true pose [s].
POLL_PERIOD = 0.02
TURN_POLL_PERIOD = 0.005
#: A robot that has not moved for this long [s] stays at rest.
SETTLED_TIME = 0.5
#: A drive ends at rest if the robot's mean speed in this time is at most MAX_REST_SPEED [m/s] and
#: MAX_REST_TURN_RATE [rad/s], so that it moves on by less than 0.3 mm and 0.1 deg [s].
REST_PERIOD = 0.001
#: A robot whose true speeds are below this stands still [m/s], [rad/s].
STILL_LINEAR = 0.001
STILL_ANGULAR = 0.01


@dataclass(frozen=True)
class SpotTurn:
    """The result of a turn on the spot; true angles, measured by the robot's real heading."""

    turned: float           # [rad], counted over whole turns
    time: float             # from the first command to rest [s]
    overshoot: float        # largest angle beyond the goal [rad]; 0 if never beyond
    fastest: float          # [rad/s], commanded


@dataclass(frozen=True)
class Drive:
    """The result of a drive; true errors, measured by the robot's real pose."""

    reached: bool
    failure: str
    time: float             # from the first command to rest [s]
    distance_error: float   # [m]
    angle_error: float      # [rad]
    max_linear: float       # fastest command [m/s]
    max_angular: float      # fastest command [rad/s]
    max_wheel: float        # fastest wheel that was commanded [m/s]
    overrun: float          # largest distance beyond the goal along its line [m]
    rested: bool            # did it rest when the core ended the drive?


def drive(goal: Pose2, robot_config: SimulatorConfig, drive_config: DriveConfig = DriveConfig(),
          declared: Pose2 = Pose2()) -> Drive:
    """Declare the robot at `declared`, and let it drive to `goal`. Both poses are in local."""
    model = robot_model(robot_config.model)
    robot = Simulator(robot_config)
    response = MotorResponse()
    navigator = MoveToGoalCore(DriveLaw(drive_config, model, response), True, response)
    _navigate(robot, navigator, 0.2)
    _reset(robot, navigator, declared)
    _navigate(robot, navigator, 0.5)
    local_T_world = declared @ robot.truth.inverse()
    navigator.set_goal(goal)
    begun = robot.now
    along = Pose2(goal.x, goal.y, declared.bearing_to(goal)).inverse() @ local_T_world
    commands: List[Twist2] = []
    overrun = -math.inf
    while navigator.status(robot.now).is_active and robot.now - begun < 180.0:
        commands += _navigate(robot, navigator, POLL_PERIOD)
        overrun = max(overrun, (along @ robot.truth).x)
    before = robot.truth
    robot.step(REST_PERIOD)
    rested = not moved(before, robot.truth, REST_PERIOD, MAX_REST_SPEED, MAX_REST_TURN_RATE)
    is_moving = True
    while is_moving:
        before, end = robot.truth, robot.now
        robot.step(POLL_PERIOD)
        is_moving = moved(before, robot.truth, POLL_PERIOD)
    here = local_T_world @ robot.truth
    status = navigator.status(robot.now)
    return Drive(
        reached=status.state is GoalState.GOAL_REACHED, failure=status.failure, time=end - begun,
        distance_error=here.distance_to(goal), angle_error=difference(here.yaw, goal.yaw),
        max_linear=max(abs(linear) for linear, _ in commands),
        max_angular=max(abs(angular) for _, angular in commands),
        max_wheel=max(abs(linear) + model.half_track * abs(angular) for linear, angular in commands),
        overrun=overrun, rested=rested)


def _reset(robot: Simulator, navigator: MoveToGoalCore, declared: Pose2) -> None:
    """Declare the pose when both sensors have been heard. At first the network may stall."""
    reset = Reset(RequestedPose(declared))
    navigator.on_reset(reset, robot.now, robot.now)
    if reset.reason:
        _navigate(robot, navigator, POLL_PERIOD)
        _reset(robot, navigator, declared)


def turns(degrees: Sequence[float], robot_config: SimulatorConfig,
          turn_config: TurnConfig = TurnConfig(), wait: float = 0.3) -> List[SpotTurn]:
    """Let a robot make several turns on the spot [deg, left positive], one after the other, the
    first one `wait` [s] after its start. Returns a SpotTurn for each."""
    robot = Simulator(robot_config)
    controller = ControllerCore(make_turn_law(turn_config, robot_model(robot_config.model)))
    _control(robot, controller, wait)
    return [_turn(robot, controller, requested) for requested in degrees]


def _turn(robot: Simulator, controller: ControllerCore, degrees: float) -> SpotTurn:
    start = yaw = robot.truth.yaw
    begun = resting_since = robot.now
    goal, sign = math.radians(degrees), math.copysign(1.0, degrees)
    commands: List[Twist2] = []
    overshoot = 0.0
    controller.request_turn(degrees, robot.now)
    while controller.driver is Driver.TURN or robot.now - resting_since < SETTLED_TIME:
        before = robot.truth
        commands += _control(robot, controller, TURN_POLL_PERIOD)
        yaw = unwrap(robot.truth.yaw, yaw)
        overshoot = max(overshoot, sign * (yaw - start - goal))
        if moved(before, robot.truth, TURN_POLL_PERIOD):
            resting_since = robot.now
    return SpotTurn(turned=yaw - start, time=resting_since - begun, overshoot=overshoot,
                    fastest=max(abs(angular) for _, angular in commands))


def moved(before: Pose2, after: Pose2, seconds: float, linear: float = STILL_LINEAR,
          angular: float = STILL_ANGULAR) -> bool:
    """Was the mean speed between two true poses above `linear` [m/s] or `angular` [rad/s]?"""
    turned = abs(difference(after.yaw, before.yaw))
    return before.distance_to(after) > linear * seconds or turned > angular * seconds


def _navigate(robot: Simulator, navigator: MoveToGoalCore, seconds: float) -> List[Twist2]:
    """Let time pass for a drive; returns the commands."""
    return run(robot, navigator, navigation(robot, navigator), seconds)


def _control(robot: Simulator, controller: ControllerCore, seconds: float) -> List[Twist2]:
    """Let time pass for a turn; returns the commands."""
    return run(robot, controller, control(robot, controller), seconds)


class Listening:
    """A stream of samples. After each sample that is read, none is read for `idle_time(now)` [s]."""

    def __init__(self, idle_time):
        self._idle_for = idle_time
        self._until = -math.inf

    def reads(self, now):
        """Does the node read a sample that arrives now?"""
        if now < self._until:
            return False
        self._until = now + self._idle_for(now)
        return True


def navigation(robot: Simulator, navigator: MoveToGoalCore) -> Callable[[Sample], None]:
    """A function that passes a robot's samples to a MoveToGoalCore, as its node does."""
    listening = Listening(navigator.idle_time)

    def hear(sample):
        if not isinstance(sample, ImuSample):
            navigator.on_odometry(sample, robot.now)
        elif listening.reads(robot.now):
            navigator.on_imu(sample, robot.now)
    return hear


def control(robot: Simulator, controller: ControllerCore) -> Callable[[Sample], None]:
    """A function that passes a robot's samples to a ControllerCore, as its node does."""
    listening = Listening(controller.idle_time)

    def hear(sample):
        if isinstance(sample, ImuSample) and listening.reads(robot.now):
            controller.on_imu(sample, robot.now)
    return hear


def newest_of(samples: Sequence[Sample], kind: type) -> List[Sample]:
    """Returns the samples that a node reads of `samples`, which arrived together: the latest one of
    `kind`, and all of other types."""
    last = max((index for index, sample in enumerate(samples) if isinstance(sample, kind)),
               default=None)
    return [sample for index, sample in enumerate(samples)
            if index == last or not isinstance(sample, kind)]


def run(robot, driver, hear, seconds, log_lines=None):
    """Let time pass. Give each sample to `hear` when it arrives, and then the command of `driver` to
    the robot. Returns the commands. The LogLines of `driver` are added to the list `log_lines`."""
    commands: List[Twist2] = []
    end = robot.now + seconds
    while robot.now < end:
        arrived = robot.step(min(1.0 / robot.config.imu_rate, end - robot.now))
        for sample in newest_of(arrived, ImuSample):
            hear(sample)
            commands += obey(robot, driver, log_lines)
        commands += obey(robot, driver, log_lines)
    return commands


def obey(robot: Simulator, driver: Union[MoveToGoalCore, ControllerCore],
         log_lines: Optional[List[LogLine]] = None) -> List[Twist2]:
    """Give the command of `driver` to the robot. Returns a list with the command, or without one."""
    output = driver.tick(robot.now, robot.now)
    if log_lines is not None:
        log_lines += output.log_lines
    if output.command is None and not output.must_stop_first:
        return []
    command = output.command or Twist2()
    robot.command(*command)
    return [command]


def least_time(start: Pose2, goal: Pose2, model: RobotModel, max_linear: float = math.inf,
               max_angular: float = math.inf, reverse: bool = False) -> float:
    """Returns the least time [s] from `start` to `goal` by a turn, a straight line and a turn.

    If the speed V of a wheel is the only limit, this time is (b (|turn1| + |turn2|) + distance) /
    V, with b half the track. The limits `max_linear` [m/s] and `max_angular` [rad/s] can make the
    time longer. Source: Balkcom and Mason, Time optimal trajectories for bounded velocity
    differential drive vehicles, 2002.
    """
    linear = min(max_linear, model.max_linear)
    angular = min(max_angular, model.max_angular)
    line = start.bearing_to(goal)
    faces = [line]
    if reverse:
        faces.append(line + math.pi)
    turn_time = min(sum_of_turns(start.yaw, face, goal.yaw) for face in faces) / angular
    return turn_time + start.distance_to(goal) / linear
