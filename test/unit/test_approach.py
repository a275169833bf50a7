"""An approach must come to rest at zero on a motor that obeys late: here a motor in closed form."""
import math
from collections import deque

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tb3_labs.approach import FIRST_DELAY, MAX_DELAY, Approach, DelayEstimate

TICK = 0.02
NEAR = math.radians(0.5)


def approach_to(remaining, delay, lag=0.05, fastest=1.5, learned=None):
    """(way left at rest, greatest overshoot, time until it stays near 0, fastest command)."""
    learned = learned or DelayEstimate()
    approach = Approach(12.0, gain=20.0, slowest=0.04, close_enough=0.003, delay=learned)
    commands = deque([0.0] * round(delay / TICK))
    speed, overshoot, time, near_at, greatest, still = 0.0, 0.0, 0.0, 0.0, 0.0, 0
    sign = math.copysign(1.0, remaining)
    while still < 10 and time < 60.0:
        commands.append(approach.step(remaining, speed, fastest, TICK))
        greatest = max(greatest, abs(commands[-1]))
        command = commands.popleft()
        # first-order lag, exact over one tick
        share = math.exp(-TICK / lag)
        travelled = command * TICK + (speed - command) * lag * (1.0 - share)
        speed = command + (speed - command) * share
        remaining -= travelled
        overshoot = max(overshoot, -sign * remaining)
        time += TICK
        if abs(remaining) > NEAR:
            near_at = time
        still = still + 1 if abs(speed) < 1e-4 and abs(approach.at_rest) <= 0.003 else 0
    return remaining, overshoot, near_at, greatest


@given(st.floats(0.02, 7.0), st.sampled_from([1.0, -1.0]), st.sampled_from([0.0, 0.02, 0.04]))
def test_comes_to_rest_at_zero_from_either_side(size, sign, delay):
    left, overshoot, _, greatest = approach_to(sign * size, delay)
    assert abs(left) <= 0.006
    assert overshoot <= NEAR
    assert greatest <= 1.5


@pytest.mark.parametrize('delay', [0.0, 0.04, 0.1, 0.2])
def test_learns_how_long_commands_are_under_way(delay):
    learned = DelayEstimate()
    approach_to(3.0, delay, learned=learned)
    assert learned.seconds == pytest.approx(delay, abs=0.002)


def test_a_learned_delay_prevents_the_overshoot_that_ignorance_causes():
    learned = DelayEstimate(0.16)
    _, with_knowledge, _, _ = approach_to(0.3, 0.16, learned=learned)
    _, without, _, _ = approach_to(0.3, 0.16, learned=DelayEstimate(0.0))
    assert with_knowledge < math.radians(1.0) < without


def test_takes_little_more_than_the_least_time():
    _, _, time, _ = approach_to(math.pi, 0.02)
    # cruise at 1.5 rad/s, speed up and brake at 12 rad/s^2, obey 0.07 s late
    assert time <= math.pi / 1.5 + 1.5 / 12.0 + 0.07 + 0.15


def test_zero_remaining_moves_nothing():
    approach = Approach(12.0, gain=20.0, slowest=0.04, close_enough=0.003, delay=DelayEstimate())
    assert [approach.step(0.0, 0.0, 1.5, TICK) for _ in range(5)] == [0.0] * 5


def test_acceleration_is_bounded():
    approach = Approach(12.0, gain=20.0, slowest=0.04, close_enough=0.003, delay=DelayEstimate())
    commands = [approach.step(3.0, 0.0, 1.5, TICK) for _ in range(4)]
    assert commands == pytest.approx([0.24, 0.48, 0.72, 0.96])


def test_dt_of_zero_changes_nothing():
    approach = Approach(12.0, gain=20.0, slowest=0.04, close_enough=0.003, delay=DelayEstimate())
    approach.step(3.0, 0.0, 1.5, TICK)
    assert approach.step(3.0, 0.0, 1.5, 0.0) == pytest.approx(0.24)


def test_delay_estimate_stays_within_bounds():
    estimate = DelayEstimate()
    assert estimate.seconds == FIRST_DELAY
    for _ in range(100):
        estimate.measured(5.0)
    assert estimate.seconds == pytest.approx(MAX_DELAY)
    for _ in range(100):
        estimate.measured(-1.0)
    assert estimate.seconds == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize('stall, backs_up', [(0.0, False), (0.2, True)])
def test_a_command_that_comes_late_is_made_good_backwards(stall, backs_up):
    """The drive to a goal, with the last 2 cm driven at the speed of one late command."""
    approach = Approach(2.0, gain=20.0, slowest=0.015, close_enough=0.0005, delay=DelayEstimate())
    remaining, speed, time, held, lowest = 0.5, 0.0, 0.0, None, 0.0
    while time < 6.0:
        command = approach.step(remaining, speed, 0.2108, TICK, backwards_from=0.008)
        if held is None and remaining < 0.02:
            held = (time + stall, command)
        if held and time < held[0]:
            command = held[1]
        share = math.exp(-TICK / 0.05)
        remaining -= command * TICK + (speed - command) * 0.05 * (1.0 - share)
        speed = command + (speed - command) * share
        time, lowest = time + TICK, min(lowest, speed)
    assert abs(remaining) <= 0.009
    assert abs(speed) < 1e-3
    assert (lowest < -0.01) is backs_up
