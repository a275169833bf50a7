"""Whole drives on the simulated robot, judged by its true pose."""
import math
import random
import statistics
from concurrent.futures import ProcessPoolExecutor

import pytest
from rollout import drive, least_time, navigation, run

from tb3_labs.control.drive_law import DriveConfig, DriveLaw
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.nodes.move_to_goal.core import MoveToGoalCore
from tb3_labs.robot.turtlebot3 import robot_model
from tb3_labs.simulation.network import NETWORKS
from tb3_labs.simulation.simulator import Simulator
from tb3_labs.simulation.simulator_config import SimulatorConfig

BURGER = robot_model('burger')
LAB_GOAL = Pose2(-0.61, 0.61, 0.0)


def random_drive(number):
    """Returns the Drive of one drive with random settings; `number` is the seed."""
    rng = random.Random(number)

    def angle():
        return rng.uniform(-180.0, 180.0)

    declared = Pose2(rng.uniform(-2.0, 2.0), rng.uniform(-2.0, 2.0), math.radians(angle()))
    goal = declared @ Pose2(rng.uniform(-1.5, 1.5), rng.uniform(-1.5, 1.5), math.radians(angle()))
    robot = SimulatorConfig(
        start_x=rng.uniform(-5.0, 5.0), start_y=rng.uniform(-5.0, 5.0), start_yaw_deg=angle(),
        imu_offset_deg=angle(), imu_rate=100.0, imu_noise_deg=rng.choice([0.0, 0.005, 0.02]),
        gyro_noise=rng.choice([0.0, 0.001, 0.005]), command_latency=rng.choice([0.0, 0.02, 0.05]),
        seed=number)
    return drive(goal, robot, declared=declared)


def test_random_drives_all_arrive_within_the_limits():
    with ProcessPoolExecutor() as pool:
        drives = list(pool.map(random_drive, range(8), chunksize=4))
    assert [(n, d.failure) for n, d in enumerate(drives) if not d.reached] == []
    for d in drives:
        assert d.max_linear <= 0.2108 + 1e-9 and d.max_angular <= 1.5 + 1e-9
        assert d.max_wheel <= 0.2109 and d.overrun <= 0.005      # never through the goal
    distances = [d.distance_error for d in drives]
    angles = [abs(math.degrees(d.angle_error)) for d in drives]
    assert statistics.median(distances) <= 0.005 and max(distances) <= 0.010
    assert statistics.median(angles) <= 0.3 and max(angles) <= 0.5


def test_a_drive_is_commanded_in_each_period_and_brakes_evenly():
    robot = Simulator(SimulatorConfig())
    core = MoveToGoalCore(DriveLaw(DriveConfig(), BURGER), True)
    hear = navigation(robot, core)
    run(robot, core, hear, 0.5)
    core.set_goal(Pose2(1.0, 0.0, 0.0))
    run(robot, core, hear, 1.0)
    assert len(run(robot, core, hear, 2.0)) == pytest.approx(60, abs=1)
    commands = [command for command in run(robot, core, hear, 4.0) if command.linear]
    assert robot.truth.x == pytest.approx(1.0, abs=0.002)
    braking = [linear for linear, _ in commands if 0.0 < linear < 0.21]
    assert len(braking) >= 7 and braking == sorted(braking, reverse=True)    # 0.2 s, at 30 Hz


def test_the_least_time_to_the_labs_goal():
    # (b (135 + 135 deg) + 0.8627 m) / V; backwards; and with the lab's limit of the turns
    assert least_time(Pose2(), LAB_GOAL, BURGER) == pytest.approx(5.88, abs=0.005)
    assert least_time(Pose2(), LAB_GOAL, BURGER, reverse=True) == pytest.approx(4.69, abs=0.005)
    assert least_time(Pose2(), LAB_GOAL, BURGER, max_angular=1.5) == pytest.approx(7.23, abs=0.005)


def test_the_labs_goal_is_reached_in_nearly_the_least_time():
    robot = SimulatorConfig(start_yaw_deg=170.0, imu_offset_deg=140.0)
    forward, either = drive(LAB_GOAL, robot), drive(LAB_GOAL, robot, DriveConfig(allow_reverse=True))
    assert forward.reached and either.reached
    assert forward.time <= 1.12 * 7.234
    assert forward.time - either.time == pytest.approx(math.pi / 1.5, abs=0.3)


@pytest.mark.parametrize('fault, lost_share, drift_deg', [
    ({'wheel_mismatch': 0.03}, 0.015, 0.0),
    ({'imu_drift_deg_per_min': 5.0}, 0.0, 5.0),
    ({'slip': 0.1, 'wheel_mismatch': 0.03, 'imu_drift_deg_per_min': 5.0}, 0.1135, 5.0)])
def test_a_drive_misses_only_by_errors_that_no_sensor_shows(fault, lost_share, drift_deg):
    """By wheels and IMU the robot reaches the goal, and does not swing about it."""
    robot = SimulatorConfig(imu_offset_deg=59.1, command_latency=0.02, **fault)
    result = drive(LAB_GOAL, robot)
    assert result.reached, result.failure
    way = Pose2().distance_to(LAB_GOAL)
    drifted = math.radians(drift_deg) / 60.0 * (result.time + 0.7)     # since the reset
    assert abs(result.distance_error - lost_share * way) <= drifted * way + 0.010
    assert abs(result.angle_error) <= drifted + math.radians(0.5)
    # slipping wheels move the robot slower: turns too
    assert result.time <= 1.25 * least_time(
        Pose2(), LAB_GOAL, BURGER, max_angular=1.5) / (1.0 - lost_share)


@pytest.mark.parametrize('network', ['good', 'busy', 'bad'])
@pytest.mark.parametrize('crosses', [False, True])
def test_drives_over_a_network_arrive_at_the_goal(network, crosses):
    """A drive on which the IMU crosses +/-180 deg, where the firmware reverses one displacement."""
    offset = 45.0 if crosses else 100.0          # the goal lies at 135 deg
    d = drive(LAB_GOAL, SimulatorConfig(imu_offset_deg=offset, **NETWORKS[network]))
    assert d.reached, d.failure
    assert d.rested and d.distance_error <= 0.01 and abs(math.degrees(d.angle_error)) <= 0.5
    assert d.max_linear <= 0.2108 + 1e-9 and d.max_angular <= 1.5 + 1e-9 and d.max_wheel <= 0.2109
