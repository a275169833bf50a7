"""The turns of the IMU lab in runs that are known in closed form."""
import math
from dataclasses import replace

import numpy as np
import pytest
from made_run import drive, driven, states, turn, values, variables

from tb3_labs.report.motion.movements import with_derived_fields
from tb3_labs.report.motion.turns import turn_reports


def one(segments, **parts):
    found, = turn_reports(driven(segments, **parts))
    return found


@pytest.mark.parametrize('degrees, offset', [(92.0, 2.5), (-92.0, 0.0)])
def test_a_turn_by_numbers(degrees, offset):
    """The IMU crosses +/-180 deg with the larger offset."""
    found = one([turn(3.0, degrees)], start=(1.0, 2.0, 0.3), imu_offset=offset)
    assert math.degrees(found.turned) == pytest.approx(degrees, abs=0.15)
    assert math.degrees(found.requested) == pytest.approx(math.copysign(90.0, degrees))
    assert math.degrees(found.error) == pytest.approx(2.0, abs=0.15)
    assert math.degrees(found.true_error) == pytest.approx(2.0, abs=0.15)
    assert found.end - found.begin == pytest.approx(math.radians(92.0) / 1.5, abs=0.02)


@pytest.mark.parametrize('degrees, requested', [
    (44.0, []), (46.0, [90.0]), (134.0, [90.0]), (-136.0, [-180.0]), (-268.0, [-180.0])])
def test_without_topic_turn_the_nearest_quarter_is_taken(degrees, requested):
    """A turn by less than half a quarter is none."""
    found = turn_reports(driven([turn(3.0, degrees)]))
    assert [math.degrees(each.requested) for each in found] == pytest.approx(requested)
    for each in found:
        assert math.degrees(each.error) == pytest.approx(abs(degrees) - abs(requested[0]), abs=0.15)


@pytest.mark.parametrize('said, requested', [
    ([(2.9, 30.0)], 30.0),                    # a small turn
    ([(2.9, 20.0), (3.1, 10.0)], 30.0),       # the turn was typed in two parts
    ([(0.9, 90.0), (2.9, 30.0)], 30.0)])      # the robot did not make the first turn
def test_the_angle_on_topic_turn_is_the_requested_angle(said, requested):
    times, angles = zip(*said)
    found = one([turn(3.0, 31.0)], turn_requests=values(times, np.radians(angles)))
    assert math.degrees(found.requested) == pytest.approx(requested)
    assert math.degrees(found.error) == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize('degrees', [268.0, 92.0])
def test_a_typed_r_asks_for_a_turn_to_the_right_whatever_the_robot_does(degrees):
    """The node prints the letter again. The l before is of a turn that the robot did not make."""
    found = one([turn(3.0, degrees)], printed=states(
        (0.5, 'l\n'), (2.0, 'Input l or r'), (2.9, 'r\n'), (2.95, 'r\nThis is r.\n')))
    assert math.degrees(found.requested) == pytest.approx(-90.0)
    assert math.degrees(found.error) == pytest.approx(-90.0 - degrees, abs=0.15)


@pytest.mark.parametrize('goal_before, goal, requested', [
    (0.0, 270.0, -90.0), (0.0, 45.0, 45.0), (170.0, 90.0, 90.0), (0.0, math.nan, 180.0)])
def test_the_goal_of_a_node_is_the_requested_angle(goal_before, goal, requested):
    """curr_yaw has the IMU's numbers. A node whose goal is not known has the nearest of the lab's angles."""
    run = driven([turn(3.0, 268.0)])
    yaws = np.degrees(run.imu.yaw)[::5] % 360.0
    times = run.imu.time[::5] + 1e-3
    is_after = times > 2.95
    half = run.imu.yaw / 2.0
    run = replace(run, imu=replace(run.imu, w=np.cos(half), z=np.sin(half)), variables=variables(
        time=times, curr_yaw=yaws, goal_yaw=np.where(is_after, goal, goal_before),
        turning=is_after & (times < 6.2)))
    found, = turn_reports(run)
    assert math.degrees(found.requested) == pytest.approx(requested, abs=1e-6)


def test_a_turn_that_goes_too_far_and_comes_back():
    first = turn(3.0, 100.0)
    found = one([first, turn(first[1] + 0.3, -8.0, 0.5)])
    assert math.degrees(found.error) == pytest.approx(2.0, abs=0.15)


def test_a_turn_whose_first_commands_the_recorder_missed():
    run = driven([turn(3.0, 90.0)])
    found, = turn_reports(replace(run, commands=run.commands.take(slice(3, None))))
    assert math.degrees(found.turned) == pytest.approx(90.0, abs=0.3)
    assert found.begin == pytest.approx(3.0, abs=0.06)


@pytest.mark.parametrize('known', [(0.0, 3.5), (3.5, 20.0)])
def test_the_true_error_is_unknown_without_the_whole_ground_truth(known):
    segments = [turn(3.0, 90.0)]
    found = one(segments, ground_truth=driven(segments).ground_truth.between(*known))
    assert math.isnan(found.true_error)


def test_the_turns_within_a_drive_are_not_listed():
    segments = drive(2.0, 135.0, 0.8, -135.0)
    assert turn_reports(with_derived_fields(driven(segments))) == []
    told = states((2.0, 'ROTATE_TO_GOAL'), (10.0, 'GOAL_REACHED'))
    found = turn_reports(driven(segments[:1] + [turn(12.0, 90.0)], states=told))
    assert [each.begin for each in found] == pytest.approx([12.0])
