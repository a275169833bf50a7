"""The drives of a recorded run: their outcome, states, errors, drift and times, from both sides of
each limit."""
import math
from dataclasses import replace

import numpy as np
import pytest
from made_run import TIME, X, ZERO, goals, imu_samples, made, poses, states
from recorded_run import MISS, MISS_DEG, in_degrees, run  # noqa: F401

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.report.motion.drives import drive_reports
from tb3_labs.report.motion.resets_and_goals import goal_errors, recorded_states

#: A shift of local_pose that is too small for a reset [m].
SHIFT = 0.015


def drive_of(run):
    drive, = drive_reports(run)
    return drive


@pytest.mark.parametrize('moves_at, counts', [(7.9, True), (8.02, False)])
def test_a_drive_is_measured_at_rest_within_a_second_of_its_end(moves_at, counts):
    late = np.where(TIME > moves_at, SHIFT, 0.0)
    drive = drive_of(made(local_pose=poses(X, late)))
    assert drive.error[0] == pytest.approx(SHIFT if counts else 0.0)


@pytest.mark.parametrize('silence, known', [(0.25, True), (0.4, False)])
def test_a_pose_long_before_the_end_gives_no_error(silence, known):
    kept = TIME <= 7.0 - silence
    drive = drive_of(made(local_pose=poses().take(kept)))
    assert math.isnan(drive.error[0]) != known and math.isnan(drive.error[1]) != known


def test_the_true_error_is_measured_in_the_true_local_frame():
    world_T_local = Pose2(5.0, -3.0, 2.0)
    truth = poses(X, np.where(TIME > 5.0, 0.05, 0.0), np.where(TIME > 6.5, 0.1, 0.0))
    run = made(ground_truth=truth.in_parent(world_T_local))
    drive = drive_of(run)
    assert drive.true_error == pytest.approx((0.05, -0.1))
    assert drive.error == pytest.approx((0.0, 0.0))


def heading(times, degrees):
    yaw = np.radians(np.interp(TIME, times, degrees))
    return imu_samples(TIME, TIME, yaw, ZERO)


def test_drift_counts_from_three_tenths_into_the_straight_part():
    """The turn before ends at 1.3 s; then the robot turns by 2 deg to the left, and by 3 back."""
    drive = drive_of(made(imu=heading([1.0, 1.3, 4.0, 5.9], [40.0, 0.0, 2.0, -1.0])))
    assert math.degrees(drive.drift) == pytest.approx(-1.0, abs=0.01)


def test_errors_are_those_of_the_goal_in_force():
    run = made(states=states((2.0, 'ROTATE_TO_GOAL'), (4.0, 'ROTATE_TO_GOAL')),
               goals=goals([2.0, 4.0], [1.0, 2.0], 0.5, 0.3))
    time, distance, angle = goal_errors(run)
    assert time[0] == 2.0 and time[-1] == 10.0 and len(time) == 161
    for moment, x in ((3.95, 1.0), (4.0, 2.0), (9.0, 2.0)):
        k = int(np.searchsorted(time, moment - 0.01))
        here = np.interp(moment, [1.0, 6.0], [0.0, 1.0])
        assert distance[k] == pytest.approx(math.hypot(x - here, 0.5))
    assert angle == pytest.approx(0.3 + 0.0 * time)


@pytest.mark.parametrize('later, is_own', [(-1.0, True), (0.09, True), (0.11, False)])
def test_a_goal_may_arrive_a_tenth_of_a_second_after_its_state(later, is_own):
    run = made(states=states((5.0, 'ROTATE_TO_GOAL')), goals=goals([5.0 + later], [1.0]))
    (span,) = recorded_states(run)
    assert (span.begin, span.end) == (5.0, 10.0)
    assert span.goal == (Pose2(1.0, 0.0, 0.0) if is_own else None)


@pytest.mark.parametrize('words, outcomes', [
    ([('ROTATE_TO_GOAL', 1), ('MOVE_FORWARD', 1)], ['recording ended']),
    ([('ROTATE_TO_GOAL', 1), ('ROTATE_TO_GOAL', 2), ('GOAL_REACHED', 2)],
     ['begun anew', 'reached']),
    ([('MOVE_FORWARD', 1), ('stopped: no imu', 1), ('ROTATE_TO_GOAL', 1), ('GOAL_REACHED', 1)],
     ['reached']),
    ([('MOVE_FORWARD', 1), ('stopped: no imu', 1), ('gave up: no imu', 1)], ['gave up: no imu']),
    ([('ROTATE_TO_FINAL', 1), ('ROTATE_TO_GOAL', 1), ('GOAL_REACHED', 1)], ['reached']),
    ([('ROTATE_TO_FINAL', 1), ('ROTATE_TO_GOAL', 2), ('GOAL_REACHED', 2)],
     ['begun anew', 'reached']),
    ([('ROTATE_TO_GOAL', 1), ('MOVE_FORWARD', 1), ('ROTATE_TO_GOAL', 1), ('GOAL_REACHED', 1)],
     ['begun anew', 'reached']),
    ([('waiting for control', 1), ('GOAL_REACHED', 1)], [])])
def test_how_drives_end(run, words, outcomes):
    """The goals are at x = 1 m and x = 2 m."""
    time = 1.0 + np.arange(len(words))
    run = replace(run, states=states(*zip(time, [word for word, _ in words])),
                  goals=goals(time, [x for _, x in words]))
    assert [drive.outcome for drive in drive_reports(run)] == outcomes


@pytest.mark.parametrize('begin, state', [(9.0, 'ROTATE_TO_FINAL'), (9.92, 'ROTATE_TO_GOAL')])
def test_a_drive_that_is_ended_by_a_reset(run, begin, state):
    words = (begin, state), (10.02, 'ROTATE_TO_GOAL'), (11.0, 'GOAL_REACHED')
    first, second = drive_reports(replace(run, states=states(*words)))
    assert (first.outcome, second.outcome) == ('begun anew', 'reached')
    assert in_degrees(first.error) == pytest.approx((MISS, MISS_DEG), abs=1e-6)
    assert in_degrees(second.error) == pytest.approx((0.5, 90.0), abs=1e-6)
