"""Motors, wheels and their pose against the motion in closed form."""
import math

import pytest

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.turtlebot3 import robot_model
from tb3_labs.simulation.body import Drivetrain

BURGER = robot_model('burger')
RADIUS, TRACK = 0.033, 0.16             # of a wheel; between the wheels [m]


def train(left=0.0, right=0.0, start=Pose2(), **physics):
    drivetrain = Drivetrain(BURGER, start)
    drivetrain.set_physics(**dict(dict(lag=0.0, mismatch=0.0, slip=0.0), **physics))
    drivetrain.set_goals(left, right)
    return drivetrain


def at(pose):
    return pytest.approx((pose.x, pose.y, pose.yaw), abs=1e-9)


@pytest.mark.parametrize('side', ['left', 'right'])
@pytest.mark.parametrize('speed', [-4.0, 4.0])
def test_a_robot_with_one_moving_wheel_pivots_about_the_other(side, speed):
    drivetrain = train(**{side: speed})
    drivetrain.advance(0.7)
    # The standing wheel stays in place; the middle is half a track beside it.
    standing, sign = (-TRACK / 2.0, -1.0) if side == 'left' else (TRACK / 2.0, 1.0)
    turned = sign * RADIUS * speed * 0.7 / TRACK
    x, y = standing * math.sin(turned), standing * (1.0 - math.cos(turned))
    pose = drivetrain.pose
    assert (pose.x, pose.y, pose.yaw) == at(Pose2(x, y, turned))
    assert drivetrain.velocity == pytest.approx(
        (RADIUS * speed / 2.0, sign * RADIUS * speed / TRACK))
    assert drivetrain.angles == pytest.approx(
        (0.7 * speed, 0.0) if side == 'left' else (0.0, 0.7 * speed))


def test_motors_turn_by_the_integral_of_their_speed():
    drivetrain, now = train(6.0, -3.0, lag=0.2), 0.0
    for time in (0.05, 0.1, 0.4, 1.0):
        drivetrain.advance(time - now)
        now = time
        fading = math.exp(-time / 0.2)
        way = time - 0.2 * (1.0 - fading)
        assert drivetrain.angles == pytest.approx((6.0 * way, -3.0 * way))
        left, right = 6.0 * (1.0 - fading), -3.0 * (1.0 - fading)
        assert drivetrain.velocity == pytest.approx(
            (RADIUS * (left + right) / 2.0, RADIUS * (right - left) / TRACK))


def test_a_motor_is_there_when_no_encoder_could_tell():
    """From 5 rad/s with 0.1 s of lag: 5e-6 rad/s off after 13.8 lags, 5e-7 after 16.2."""
    drivetrain = train(5.0, 5.0, lag=0.1)
    drivetrain.advance(1.5)
    assert drivetrain.velocity[0] < RADIUS * 5.0
    drivetrain.advance(0.1)
    assert drivetrain.velocity == (RADIUS * 5.0, 0.0)


def test_the_wheels_carry_the_robot_as_far_as_their_own_size_says():
    drivetrain = train(4.0, 4.0, mismatch=0.2, slip=0.5)
    left, right = RADIUS * 0.5 * 4.0, RADIUS * 0.5 * 0.8 * 4.0     # over the floor [m/s]
    assert drivetrain.velocity == pytest.approx(((left + right) / 2.0, (right - left) / TRACK))
    drivetrain.advance(2.0)
    turned = 2.0 * (right - left) / TRACK
    radius = TRACK / 2.0 * (right + left) / (right - left)
    pose = drivetrain.pose
    assert (pose.x, pose.y, pose.yaw) == at(Pose2(
        radius * math.sin(turned), radius * (1.0 - math.cos(turned)), turned))
    assert drivetrain.angles == pytest.approx((8.0, 8.0))          # the motors do not know


def test_physics_that_change_while_it_drives_count_from_then_on():
    drivetrain = train(5.0, 5.0, lag=0.1)
    drivetrain.advance(0.05)
    speed = 5.0 * (1.0 - math.exp(-0.5))
    drivetrain.set_physics(lag=0.4, mismatch=0.0, slip=0.1)
    drivetrain.advance(0.2)
    now = 5.0 + (speed - 5.0) * math.exp(-0.5)
    assert drivetrain.velocity == pytest.approx((0.9 * RADIUS * now, 0.0))
    drivetrain.set_physics(lag=0.0, mismatch=0.0, slip=0.1)        # without lag: at once
    assert drivetrain.velocity == pytest.approx((0.9 * RADIUS * 5.0, 0.0))
