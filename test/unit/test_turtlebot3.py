"""The robots' numbers against motors, gears and the firmware's tables; the limits of robot and wheels."""
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tb3_labs.robot.turtlebot3 import MODELS, Twist2, model_of_environment, robot_model, saturate
from tb3_labs.ros.robot_description import WHEEL_WIDTH
from tb3_labs.simulation.firmware import MOTOR_SPEED_STEP, TICK_ANGLE

SPEEDS = st.floats(-10.0, 10.0)


def rim_speed(rpm, radius=0.033):
    return rpm / 60.0 * 2.0 * math.pi * radius


def test_the_burgers_limits_are_its_motors():
    burger = robot_model('burger')
    assert TICK_ANGLE == pytest.approx(0.001533981, abs=5e-10)
    assert MOTOR_SPEED_STEP == pytest.approx(0.0239809, abs=1e-6)   # 0.229 rpm in rad/s
    assert WHEEL_WIDTH == 0.018               # turtlebot3_description's wheels
    assert burger.motor_steps * MOTOR_SPEED_STEP * 0.033 == pytest.approx(0.2097, abs=5e-5)
    assert robot_model('waffle').motor_steps == robot_model('waffle_pi').motor_steps == 330
    assert burger.max_linear == pytest.approx(burger.max_wheel_speed, abs=5e-5)
    assert burger.max_angular == pytest.approx(rim_speed(61.0) / 0.080, abs=1e-3)
    assert robot_model('waffle').half_track == 0.1435 and burger.max_wheel_speed == pytest.approx(rim_speed(61.0))


def test_an_invalid_model_names_its_source():
    with pytest.raises(ValueError, match="^TURTLEBOT3_MODEL = 'burgr' is not valid: one of burger"):
        model_of_environment({'TURTLEBOT3_MODEL': 'burgr'})
    with pytest.raises(ValueError, match="^model = 'wafle' is not valid: one of burger, waffle, w"):
        robot_model('wafle')
    assert model_of_environment({'TURTLEBOT3_MODEL': 'waffle'}) is MODELS['waffle']
    assert model_of_environment({'TURTLEBOT3_MODEL': ''}) is MODELS['burger']


def wheels(twist, model):
    """Rim speeds of left and right wheel, from the geometry of a differential drive."""
    return (twist.linear - model.wheel_separation / 2.0 * twist.angular,
            twist.linear + model.wheel_separation / 2.0 * twist.angular)


@given(SPEEDS, SPEEDS, st.floats(0.0, 1.0), st.floats(0.0, 5.0), st.sampled_from(sorted(MODELS)))
def test_no_wheel_and_no_limit_is_exceeded(linear, angular, max_linear, max_angular, name):
    model = MODELS[name]
    twist = saturate(Twist2(linear, angular), max_linear, max_angular, model)
    assert abs(twist.linear) <= min(max_linear, model.max_linear)
    assert abs(twist.angular) <= min(max_angular, model.max_angular)
    rim = model.wheel_radius * model.motor_rpm * 2.0 * math.pi / 60.0
    assert max(map(abs, wheels(twist, model))) <= rim * (1 + 1e-12)
    assert twist.linear * linear >= 0.0 and twist.angular * angular >= 0.0


@given(st.floats(-0.2108, 0.2108), st.floats(-2.635, 2.635))
def test_saturation_keeps_the_curve(linear, angular):
    twist = saturate(Twist2(linear, angular), 1.0, 5.0, MODELS['burger'])
    assert twist.linear * angular == pytest.approx(twist.angular * linear, abs=1e-12)
    if max(map(abs, wheels(Twist2(linear, angular), MODELS['burger']))) < 0.2107:
        assert twist == (linear, angular)
    elif abs(linear) > 1e-6:
        assert max(map(abs, wheels(twist, MODELS['burger']))) == pytest.approx(0.2108, abs=1.5e-4)


@pytest.mark.parametrize('law', [
    lambda: saturate(Twist2(math.nan, 0.0), 0.2, 1.5, MODELS['burger']).linear,
    lambda: saturate(Twist2(0.0, math.nan), 0.2, 1.5, MODELS['burger']).angular])
def test_nan_is_never_clipped_to_a_speed(law):
    assert math.isnan(law())
