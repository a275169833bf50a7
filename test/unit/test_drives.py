"""The drives of a recorded run: their errors, their outcome, their states, in closed form."""
import math
from dataclasses import replace

import numpy as np
import pytest
from recorded_run import BURGER, MISS, MISS_DEG, TRUE_DEG, bag, in_degrees, run  # noqa: F401

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.report import drives as analysis
from tb3_labs.report.run_data import Poses, States


def test_the_drives_numbers(run):
    first, second = analysis.drives(run, BURGER)
    assert in_degrees(first.measured) == pytest.approx((MISS, MISS_DEG), abs=1e-6)
    assert in_degrees(first.true) == pytest.approx((0.05, TRUE_DEG), abs=1e-6)
    assert (first.outcome, second.outcome) == ('reached', 'gave up: it is stuck, alas')
    assert first.time == pytest.approx(6.5, abs=0.005)
    assert first.least_time == pytest.approx(1.0 / BURGER.max_linear)
    assert first.in_state == pytest.approx(
        {'ROTATE_TO_GOAL': 0.5, 'MOVE_FORWARD': 5.0, 'ROTATE_TO_FINAL': 1.0}, abs=0.005)
    assert math.degrees(first.drift) == pytest.approx(0.47, abs=0.002)    # 4.7 s at 0.1 deg/s
    assert math.degrees(first.deviation) == pytest.approx(0.47, abs=0.002)
    assert in_degrees(second.measured) == pytest.approx((0.5, 90.0), abs=1e-6)
    assert in_degrees(second.true) == pytest.approx((0.5, 90.0), abs=1e-6)
    assert math.isnan(second.drift)


def test_errors_to_the_goal_over_time(run):
    time, distance, angle = analysis.goal_errors(run)
    middle = np.argmin(np.abs(time - 3.5))
    assert distance[middle] == pytest.approx(1.0 - 0.5 * (1.0 - MISS), abs=1e-6)
    assert math.degrees(angle[middle]) == pytest.approx(-0.25, abs=1e-6)
    assert (distance[-1], math.degrees(angle[-1])) == pytest.approx((0.5, -90.0))


GOALS = {1: (1.0, 0.0), 2: (2.0, 0.0)}


@pytest.mark.parametrize('states, outcomes', [
    ([('ROTATE_TO_GOAL', 1), ('MOVE_FORWARD', 1)], ['recording ended']),
    ([('ROTATE_TO_GOAL', 1), ('waiting for control', 1)], ['waiting for control']),
    ([('ROTATE_TO_GOAL', 1), ('ROTATE_TO_GOAL', 2), ('GOAL_REACHED', 2)],
     ['replaced by a new goal', 'reached']),
    ([('MOVE_FORWARD', 1), ('stopped: no imu', 1), ('ROTATE_TO_GOAL', 1), ('GOAL_REACHED', 1)],
     ['reached']),
    ([('MOVE_FORWARD', 1), ('stopped: no imu', 1), ('ROTATE_TO_GOAL', 2), ('GOAL_REACHED', 2)],
     ['replaced by a new goal', 'reached']),
    ([('MOVE_FORWARD', 1), ('stopped: no imu', 1), ('gave up: no imu', 1)], ['gave up: no imu']),
    ([('ROTATE_TO_FINAL', 1), ('ROTATE_TO_GOAL', 1), ('GOAL_REACHED', 1)], ['reached']),
    ([('ROTATE_TO_FINAL', 1), ('ROTATE_TO_GOAL', 2), ('GOAL_REACHED', 2)],
     ['replaced by a new goal', 'reached']),
    ([('ROTATE_TO_GOAL', 1), ('stopped: no imu', 1), ('MOVE_FORWARD', 1), ('GOAL_REACHED', 1)],
     ['reached']),
    ([('ROTATE_TO_GOAL', 1), ('MOVE_FORWARD', 1), ('ROTATE_TO_GOAL', 1), ('GOAL_REACHED', 1)],
     ['begun anew', 'reached']),
    ([('waiting for control', 1), ('GOAL_REACHED', 1)], [])])
def test_how_drives_end(run, states, outcomes):
    time = 1.0 + np.arange(len(states))
    x, y = np.array([GOALS[goal] for _, goal in states]).T
    words = np.array([word for word, _ in states], dtype=object)
    run = replace(run, states=States(time, time, words), goals=Poses(time, time, x, y, 0.0 * x))
    assert [drive.outcome for drive in analysis.drives(run, BURGER)] == outcomes


@pytest.mark.parametrize('state', ['ROTATE_TO_GOAL', 'ROTATE_TO_FINAL'])
def test_a_drive_that_is_ended_by_a_reset(run, state):
    time = np.array([9.0, 10.02, 11.0])
    words = np.array([state, 'ROTATE_TO_GOAL', 'GOAL_REACHED'], dtype=object)
    run = replace(run, states=States(time, time, words))
    assert [drive.outcome for drive in analysis.drives(run, BURGER)] == [
        'ended by a reset', 'reached']


def test_a_short_drive_that_is_ended_by_a_reset(run):
    time = np.array([9.92, 10.02, 11.0])
    words = np.array(['ROTATE_TO_GOAL', 'ROTATE_TO_GOAL', 'GOAL_REACHED'], dtype=object)
    first, second = analysis.drives(replace(run, states=States(time, time, words)), BURGER)
    assert (first.outcome, second.outcome) == ('ended by a reset', 'reached')
    assert in_degrees(first.measured) == pytest.approx((MISS, MISS_DEG), abs=1e-6)
    assert in_degrees(second.measured) == pytest.approx((0.5, 90.0), abs=1e-6)


@pytest.mark.parametrize('lost, later', [(False, 0.001), (False, -0.001), (True, 0.001)])
def test_states_that_arrive_in_a_burst(run, lost, later):
    """Their times are those of the goals that were sent with them, in the same order."""
    arrival, sent = np.array([1.0, 8.0, 8.0, 8.0]), np.array([1.0, 6.0, 7.0, 7.5])
    states = States(arrival, arrival, np.array(
        ['ROTATE_TO_GOAL', 'MOVE_FORWARD', 'ROTATE_TO_FINAL', 'GOAL_REACHED'], dtype=object))
    heard = arrival + later * np.array([1, 3, 2, 1] if later < 0.0 else [1, 1, 2, 3])
    goals = Poses(heard, sent, 1.0 + 0.0 * sent, 0.0 * sent, 0.0 * sent)
    run = replace(run, states=states, goals=goals.take(slice(0, 3 if lost else 4)))
    assert [span.begin for span in analysis.spans(run)] == pytest.approx(
        [1.0, 6.0, 7.0, 8.0 if lost else 7.5])
    assert all(span.goal == Pose2(1.0, 0.0, 0.0) for span in analysis.spans(run))
