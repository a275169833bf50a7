"""The roll-outs' own figures, on robots whose faults make each of them large by a known amount.

A limit that is only checked from one side holds for a figure that is always 0, too.
"""
import math

import pytest
import rollout
from rollout import drive, turns

from tb3_labs.control.drive_config import DriveConfig
from tb3_labs.control.least_time import least_time
from tb3_labs.control.turning import TurnConfig
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT, robot_model
from tb3_labs.simulation.simulator_config import SimulatorConfig

BURGER = robot_model('burger')
AHEAD = Pose2(1.0, 0.0, 0.0)
LAG = 0.05                              # of the motors, as they are by default [s]


@pytest.fixture(scope='module')
def straight():
    return drive(AHEAD, SimulatorConfig(start_yaw_deg=30.0, imu_offset_deg=70.0))


def test_a_straight_drive_takes_the_wheels_to_their_limit(straight):
    assert straight.reached and straight.failure == '' and straight.rested
    assert 0.95 * 0.2108 <= straight.max_linear <= 0.2108 + 1e-9
    assert straight.max_linear <= straight.max_wheel <= 0.2109
    assert straight.max_angular <= 0.5
    least = least_time(Pose2(), AHEAD, BURGER)
    assert least <= straight.time <= 1.25 * least + 1.0
    assert -0.01 <= straight.overrun <= 0.005


def test_a_turn_takes_the_rate_to_its_limit():
    result = drive(Pose2(0.0, 0.0, math.pi), SimulatorConfig())
    assert 1.4 <= result.max_angular <= 1.5 + 1e-9
    assert result.max_wheel == pytest.approx(0.08 * result.max_angular, abs=0.02)
    assert math.pi / 1.5 <= result.time <= math.pi / 1.5 + 2.0


@pytest.mark.parametrize('mismatch', [-0.1, -0.2])
def test_a_right_wheel_that_is_larger_overruns_by_a_known_share_of_the_way(mismatch):
    """The IMU holds the robot straight, so the larger wheel turns less. The odometry does not know
    the mismatch: it measures (1 + 1 / (1 - mismatch)) / 2 of the true way."""
    result = drive(AHEAD, SimulatorConfig(wheel_mismatch=mismatch))
    seen = (1.0 + 1.0 / (1.0 - mismatch)) / 2.0
    assert result.reached
    assert result.overrun == pytest.approx(1.0 / seen - 1.0, abs=0.012)
    assert result.distance_error == pytest.approx(1.0 / seen - 1.0, abs=0.012)


@pytest.mark.parametrize('goal', [AHEAD, Pose2(-0.6, 0.6, 0.0)])
def test_slip_falls_short_by_its_share_of_the_way(goal):
    result = drive(goal, SimulatorConfig(slip=0.2), declared=Pose2())
    way = math.hypot(goal.x, goal.y)
    assert result.reached
    assert result.distance_error == pytest.approx(0.2 * way, abs=0.015)
    assert result.overrun == pytest.approx(-0.2 * way, abs=0.015)


@pytest.mark.parametrize('drift_deg', [-60.0, 60.0])
def test_an_imu_that_drifts_leaves_the_robot_turned_the_other_way(drift_deg):
    """By the IMU, the goal's heading is off by the drift since the reset, 0.5 s before the drive.
    The robot stands turned by this angle, against the drift."""
    result = drive(AHEAD, SimulatorConfig(imu_drift_deg_per_min=drift_deg))
    drifted = math.radians(drift_deg) / 60.0 * (result.time + 0.5)
    assert result.reached
    assert result.angle_error == pytest.approx(-drifted, abs=math.radians(0.8))


def test_a_drive_that_is_given_up_in_full_motion_is_no_rest_and_coasts():
    result = drive(Pose2(5.0, 0.0, 0.0), SimulatorConfig(), give_up_after=3.0)
    assert not result.reached and not result.rested and result.failure == ''
    # no zero is sent: the board waits for its timeout and a tick, then the motors' lag
    fading = LAG * math.log(0.2108 / 0.001)
    assert result.time == pytest.approx(3.0 + COMMAND_TIMEOUT + 1 / 60 + fading, abs=0.06)
    coasted = 0.2108 * (COMMAND_TIMEOUT + 1 / 60 + LAG)
    assert 5.0 - result.distance_error == pytest.approx(5.0 + result.overrun + coasted, abs=0.02)
    assert -4.6 < result.overrun < -4.3


def test_where_it_is_declared_and_where_it_truly_starts_do_not_matter():
    """The goal is a metre ahead of the declared pose, for any such pose and any start."""
    declared = Pose2(3.0, -2.0, 2.0)
    result = drive(declared @ AHEAD, SimulatorConfig(start_x=-4.0, start_y=1.0, slip=0.2),
                   declared=declared)
    assert result.distance_error == pytest.approx(0.2, abs=0.015)
    assert result.overrun == pytest.approx(-0.2, abs=0.015)


# Turns --------------------------------------------------------------------------------------------

@pytest.mark.parametrize('degrees', [90.0, -90.0, 400.0, -720.0])
def test_a_turn_is_counted_over_whole_turns(degrees):
    turn, = turns([degrees], SimulatorConfig(start_yaw_deg=170.0))
    assert math.degrees(turn.turned) == pytest.approx(degrees, abs=0.6)
    assert 1.4 <= turn.fastest <= 1.5 + 1e-9
    least = math.radians(abs(degrees)) / 1.5
    assert least <= turn.time <= 1.1 * least + 1.5
    assert 0.0 <= math.degrees(turn.overshoot) <= 0.6


@pytest.mark.parametrize('degrees', [90.0, -90.0])
def test_a_turn_by_an_imu_that_lags_behind_goes_too_far_by_what_it_lacks(degrees):
    """An IMU that drifts against the turn, by 10 deg each second, measures too little of it."""
    drift = -math.copysign(600.0, degrees)
    turn, = turns([degrees], SimulatorConfig(imu_drift_deg_per_min=drift))
    beyond = abs(math.degrees(turn.turned)) - 90.0
    assert beyond == pytest.approx(10.0 * turn.time, abs=3.0) and beyond > 8.0
    assert math.degrees(turn.overshoot) == pytest.approx(beyond, abs=1.0)


@pytest.mark.parametrize('degrees', [90.0, -90.0])
def test_a_turn_that_stays_behind_its_goal_has_no_overshoot(degrees):
    drift = math.copysign(600.0, degrees)
    turn, = turns([degrees], SimulatorConfig(imu_drift_deg_per_min=drift))
    assert abs(math.degrees(turn.turned)) < 85.0 and turn.overshoot == 0.0


def test_turns_follow_each_other_and_each_is_measured_from_its_own_begin():
    results = turns([90.0, -45.0, 180.0], SimulatorConfig(), TurnConfig(law='precise'))
    assert [math.degrees(turn.turned) for turn in results] == pytest.approx(
        [90.0, -45.0, 180.0], abs=1.0)
    assert all(turn.time < 0.7 * 180.0 / 60.0 + 2.0 for turn in results)


def test_the_handouts_law_drives_slower_than_the_limit_and_is_seen_to():
    result = drive(Pose2(0.6, 0.0, 0.0), SimulatorConfig(), DriveConfig(law='lab'))
    assert result.reached and result.max_linear < 0.2 and result.time > 0.6 / 0.2108


def test_what_the_figures_are_judged_by():
    """The limits themselves: another limit would change every benchmark."""
    assert (rollout.LOOK_PERIOD, rollout.TURN_LOOK_PERIOD, rollout.SETTLED_TIME) == (
        0.02, 0.005, 0.5)
    assert rollout.AT_REST == (0.005, 0.03)
    assert (rollout.STILL_LINEAR, rollout.STILL_ANGULAR) == (0.001, 0.01)
