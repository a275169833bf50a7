"""An approach must come to rest at zero with a slow motor, which is in closed form here."""
import math
from collections import deque

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tb3_labs.control.braking import Approach, ApproachConfig, braking_speed
from tb3_labs.control.motor_response import MotorResponse

TICK = 0.02
NEAR = math.radians(0.5)


@pytest.mark.parametrize('way, speed', [
    (0.0, 0.0), (1 / 32, 1 / 8), (1 / 16, 1 / 4), (2 + 1 / 32, 2.0), (8 + 1 / 32, 4.0)])
def test_braking_on_numbers(way, speed):
    """a = 1, gain 4: the line 4 d up to d = 1/16, then v^2 = 2 (d - 1/32)."""
    assert braking_speed(way, 1.0, 4.0) == pytest.approx(speed)
    assert math.isnan(braking_speed(math.nan, 1.0, 1.0))


def make_approach(acceleration, response=None, **more):
    """Returns settings that brake with half the acceleration; the others are as in a turn."""
    settings = dict(gain=20.0, min_speed=0.04, dead_band=0.003, nudge_time=TICK)
    settings.update(more)
    return Approach(ApproachConfig(period=TICK, acceleration=acceleration,
                                   deceleration=0.5 * acceleration, **settings),
                    response or MotorResponse())


def moved(remaining, speed, command, lag=0.05):
    """(remaining way, speed) after one tick of a motor with a first-order lag, exactly."""
    share = math.exp(-TICK / lag) if lag else 0.0
    return (remaining - command * TICK - (speed - command) * lag * (1.0 - share),
            command + (speed - command) * share)


def approach_to(remaining, delay, lag=0.05, max_speed=1.5, learned=None, prompt=False,
                lost=0):
    """(remaining way at rest, greatest overshoot, time until it stays near 0, max_speed command).

    The first `lost` commands never arrive.
    """
    approach = make_approach(24.0, learned, measures_instant_speed=prompt)
    commands = deque([0.0] * round(delay / TICK))
    speed, overshoot, time, near_at, greatest, still = 0.0, 0.0, 0.0, 0.0, 0.0, 0
    sign = math.copysign(1.0, remaining)
    while still < 10 and time < 60.0:
        commands.append(approach.step(remaining, speed, max_speed, TICK))
        greatest = max(greatest, abs(commands[-1]))
        command = commands.popleft()
        if time < lost * TICK:
            command = 0.0    # this command is lost
        remaining, speed = moved(remaining, speed, command, lag)
        overshoot = max(overshoot, -sign * remaining)
        time += TICK
        if abs(remaining) > NEAR:
            near_at = time
        rests = abs(speed) < 1e-4 and abs(approach.predicted_remaining.value) <= 0.003
        still = still + 1 if rests else 0
    return remaining, overshoot, near_at, greatest


@given(st.floats(0.02, 7.0), st.sampled_from([1.0, -1.0]), st.sampled_from([0.0, 0.02, 0.04]),
       st.booleans())
def test_an_approach_rests_at_zero_from_both_sides(size, sign, delay, prompt):
    left, overshoot, _, greatest = approach_to(sign * size, delay, prompt=prompt)
    assert abs(left) <= 0.006
    assert overshoot <= NEAR
    assert greatest <= 1.5


@pytest.mark.parametrize('known', [(0.12, 0.0), (0.0, 0.15), (0.3, 0.05)])
@pytest.mark.parametrize('lag, lost', [(0.0, 5), (0.05, 10), (0.1, 0), (0.1, 10)])
@pytest.mark.parametrize('prompt', [True, False])
def test_an_approach_rests_in_time_with_wrong_values_of_the_robot(known, lag, lost, prompt):
    left, _, time, _ = approach_to(1.57, 0.04, lag, learned=MotorResponse(*known), prompt=prompt, lost=lost)
    assert abs(left) <= 0.006
    assert time < 1.57 / 1.5 + lost * TICK + 1.45      # before the robot is treated as stalled


def test_acceleration_is_bounded_and_a_dt_of_zero_changes_nothing():
    approach = make_approach(12.0)
    commands = [approach.step(3.0, 0.0, 1.5, dt) for dt in (TICK, 0.0, TICK, TICK)]
    assert commands == pytest.approx([0.24, 0.24, 0.48, 0.72])


@pytest.mark.parametrize('age, rests', [(0.0, True), (0.158, True), (0.162, False), (0.3, False)])
def test_only_stops_are_obeyed_after_the_last_command_is_over(age, rests):
    """One command at 0 s, then stops. It is over two periods of 20 ms after a delay of 0.1 s, so a sample at 0.14 s or
    later shows a robot with the command to rest; now is 0.3 s."""
    approach = make_approach(1e3, MotorResponse(delay=0.1, lag=0.0), max_overshoot=10.0)
    assert approach.step(1.0, 0.0, 1.0, TICK) == 1.0
    assert [approach.step(0.0, 0.0, 1.0, TICK) for _ in range(15)] == 15 * [0.0]
    assert approach.obeyed_only_stops(age) is rests


def test_reversals_and_nudges_lower_the_gain_and_a_nudge_is_held():
    """A robot that obeys at once, 5 cm from zero: by a gain of 20, then of 20 / 2, 20 / 2.5 and 0."""
    approach = make_approach(1e4, MotorResponse(0.0, 0.0), nudge_time=1.5 * TICK)
    commands = [approach.step(remaining, 0.0, 9.0, TICK)
                for remaining in (0.05, -0.05, -0.05, 0.0, -0.05, 0.0, 0.0)]
    assert commands == pytest.approx([1.0, -1.0, -0.5, 0.0, -0.4, -0.4, 0.0])


def test_noisy_samples_are_averaged_while_the_robot_moves():
    """The robot obeys at once, and all samples are exact: the estimate is exact, too."""
    approach, remaining, speed = make_approach(1e3, MotorResponse(0.0, 0.0)), 3.0, 0.0
    for _ in range(20):
        remaining -= speed * TICK
        speed = approach.step(remaining, speed, 1.0, TICK, noise=0.3)
        assert speed == 1.0 and approach.predicted_remaining.value == pytest.approx(remaining)
    assert approach.predicted_remaining.uncertainty < 0.3


def test_a_sample_that_is_used_twice_counts_once():
    """The first one is used again a period later; the third step has another, which is older."""
    approach = make_approach(1e4, MotorResponse(0.0, 0.0))
    uncertainties = []
    for age in (0.01, 0.01 + TICK, 0.045):
        approach.step(1.0, 0.0, 1.0, TICK, noise=0.1, age=age)
        uncertainties.append(approach.predicted_remaining.uncertainty)
    assert uncertainties == pytest.approx([0.2, 0.2, 0.2 / math.sqrt(2.0)], rel=1e-3)


@pytest.mark.parametrize('speed, doubt', [(0.0, 0.004), (3.0, 0.012), (-3.0, 0.012)])
def test_the_way_is_uncertain_by_2_ms_of_the_faster_speed(speed, doubt):
    """The error is two standard deviations, after an exact sample that is used twice."""
    approach = make_approach(1e4, MotorResponse(0.0, 0.0))
    assert approach.step(1.0, 0.0, 1.0, TICK) == 1.0 and approach.predicted_remaining.uncertainty == 0.0
    approach.step(1.0, speed, 1.0, TICK, age=TICK)
    assert approach.predicted_remaining.uncertainty == pytest.approx(doubt)
