"""Speed laws and limits: the physics of braking, the limits of a wheel."""
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tb3_labs.control.commands import braking_speed
from tb3_labs.robot.turtlebot3 import MODELS, Twist2, saturate

BURGER = MODELS['burger']
SPEEDS = st.floats(-10.0, 10.0)
DECELERATIONS = st.floats(0.05, 40.0)
GAINS = st.floats(0.1, 30.0)
NAN = math.nan


# Braking ------------------------------------------------------------------------------------------

@pytest.mark.parametrize('way, speed', [
    (0.0, 0.0), (1 / 32, 1 / 8), (1 / 16, 1 / 4), (2 + 1 / 32, 2.0), (8 + 1 / 32, 4.0)])
@pytest.mark.parametrize('side', [1, -1])
def test_braking_on_numbers(way, speed, side):
    """a = 1, gain 4: the line 4 d up to d = 1/16, then v^2 = 2 (d - 1/32)."""
    assert braking_speed(side * way, 1.0, 4.0) == pytest.approx(side * speed)


@given(DECELERATIONS, GAINS)
def test_line_and_parabola_meet_without_a_step_or_a_kink(deceleration, gain):
    meeting = deceleration / gain ** 2
    h = 1e-5 * meeting
    below, at, above = (braking_speed(meeting + k * h, deceleration, gain) for k in (-1, 0, 1))
    assert at == pytest.approx(deceleration / gain)
    assert (at - below) / h == pytest.approx(gain, rel=1e-3)
    assert (above - at) / h == pytest.approx(gain, rel=1e-3)


# Limits -------------------------------------------------------------------------------------------

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
def test_where_both_ask_too_much_of_a_wheel_the_curve_stays(linear, angular):
    twist = saturate(Twist2(linear, angular), 1.0, 5.0, BURGER)
    assert twist.linear * angular == pytest.approx(twist.angular * linear, abs=1e-12)
    if max(map(abs, wheels(Twist2(linear, angular), BURGER))) < 0.2107:
        assert twist == (linear, angular)
    elif abs(linear) > 1e-6:
        assert max(map(abs, wheels(twist, BURGER))) == pytest.approx(0.2108, abs=1.5e-4)


@pytest.mark.parametrize('law', [
    lambda: braking_speed(NAN, 1.0, 1.0),
    lambda: saturate(Twist2(NAN, 0.0), 0.2, 1.5, BURGER).linear,
    lambda: saturate(Twist2(0.0, NAN), 0.2, 1.5, BURGER).angular])
def test_nan_never_becomes_a_speed(law):
    assert math.isnan(law())
