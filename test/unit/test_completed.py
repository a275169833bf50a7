"""Drives of nodes that say nothing of themselves: their local frame, states and errors follow from
sensors, commands and resets."""
import math
from dataclasses import replace

import numpy as np
import pytest
from made_motion import drive, driven, resets, turn, values
from made_run import goals, made
from recorded_run import odometry_jumps

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.move2goal import GOAL
from tb3_labs.nodes.move_to_goal import MoveToGoalConfig
from tb3_labs.report import analysis
from tb3_labs.report.completed import LAB_GOAL, RESTED, TAKEN, completed
from tb3_labs.report.declared import declared_by
from tb3_labs.report.epochs import epochs
from tb3_labs.robot.turtlebot3 import robot_model

BURGER = robot_model('burger')
START, OFFSET = (1.0, -0.5, 2.8), 2.45
#: A turn to the left, 0.8 m, and back by 133 deg, so that the robot faces 2 deg at last.
DRIVE = drive(2.0, 135.0, 0.8, -133.0)
END = 0.8 * math.cos(math.radians(135.0)), 0.8 * math.sin(math.radians(135.0))


def run_of(segments=DRIVE, **parts):
    return completed(driven(segments, start=START, imu_offset=OFFSET, **parts))


def drives(run):
    return analysis.drives(run, BURGER)


def test_the_labs_goal_is_one_in_all_rooms():
    config = MoveToGoalConfig()
    assert LAB_GOAL == config.goal == Pose2(*GOAL)


def test_a_drive_by_numbers():
    run = run_of()
    found, = drives(run)
    off = math.hypot(END[0] + 0.61, END[1] - 0.61)
    assert found.goal == LAB_GOAL and found.outcome == RESTED
    assert found.measured == pytest.approx((off, math.radians(-2.0)), abs=2e-3)
    assert found.true == pytest.approx((off, math.radians(-2.0)), abs=2e-3)
    times = math.radians(135.0) / 1.5 + 0.1, 4.0 + 0.1, math.radians(133.0) / 1.5
    assert [found.in_state[state] for state in (
        'ROTATE_TO_GOAL', 'MOVE_FORWARD', 'ROTATE_TO_FINAL')] == pytest.approx(
            [times[0], times[1] - 0.1, times[2] + 0.1], abs=1e-6)
    assert found.time == pytest.approx(sum(times))
    assert found.drift == pytest.approx(0.0, abs=1e-3)
    assert run.derived == ('local_pose', 'frames', 'states', 'goals')
    assert run.recorded() == ('imu', 'odometry', 'commands', 'ground_truth')


def test_another_goal():
    found, = drives(completed(driven(DRIVE), Pose2(END[0], END[1], math.radians(2.0))))
    assert found.measured == pytest.approx((0.0, 0.0), abs=2e-3)


def test_a_reset_declares_where_the_robot_is():
    """The same drive twice: the second one begins at (0.5, -0.2), facing 90 deg."""
    later = drive(13.0, 135.0, 0.8, -133.0)
    run = run_of(DRIVE + later, duration=30.0, resets=resets((12.0, 0.5, -0.2, math.pi / 2.0)))
    first, second = drives(run)
    assert len(epochs(run)) == 2 and epochs(run)[1].begin == pytest.approx(12.0, abs=0.04)
    assert first.measured[0] == pytest.approx(math.hypot(END[0] + 0.61, END[1] - 0.61), abs=2e-3)
    end = 0.5 - END[1], -0.2 + END[0]                    # END, turned by 90 deg
    for miss in second.measured, second.true:
        assert miss[0] == pytest.approx(math.hypot(end[0] + 0.61, end[1] - 0.61), abs=2e-3)
        assert math.degrees(miss[1]) == pytest.approx(-92.0, abs=0.2)


def test_a_reset_while_it_drives_ends_the_drive():
    run = run_of([turn(2.0, 90.0), (3.2, 12.0, 0.2, 0.0)], resets=resets((8.02, 0.0, 0.0, 0.0)),
                 control=values([1.0], [1.0]))
    first, second = drives(run)
    assert (first.outcome, second.outcome) == ('ended by a reset', RESTED)
    assert second.begin == pytest.approx(8.1)
    assert list(second.in_state) == ['ROTATE_TO_GOAL', 'MOVE_FORWARD']


def test_a_person_who_takes_control_ends_the_drive():
    found, = drives(run_of(DRIVE[:2], control=values([1.0, DRIVE[1][1] - 0.1], [1.0, 0.0])))
    assert found.outcome == TAKEN


def test_a_recording_that_ends_in_a_drive():
    found, = drives(run_of([turn(2.0, 90.0), (3.2, 20.0, 0.1, 0.0)]))
    assert found.outcome == 'recording ended'


def test_the_robots_own_reset_leaves_the_local_pose():
    run = driven(DRIVE, start=START, imu_offset=OFFSET)
    k = int(np.searchsorted(run.odometry.time, 11.0))
    run = completed(odometry_jumps(run, float(run.odometry.time[k]), run.odometry.pose(k).inverse()))
    assert len(epochs(run)) == 1
    last = run.local_pose.pose(-1)
    assert (last.x, last.y, last.yaw) == pytest.approx((*END, math.radians(2.0)), abs=5e-3)


def test_a_recording_of_the_packages_own_node_stays_as_it_is():
    run = made()
    assert completed(run) is run
    run = replace(driven(DRIVE), goals=goals([0.0], [1.0]))
    assert completed(run).derived == ('local_pose', 'frames', 'states')
    assert drives(completed(run))[0].goal == Pose2(1.0, 0.0, 0.0)


@pytest.mark.parametrize('line, pose', [
    ('Local pose set to x=1.50, y=-0.25, yaw=1.57', (1.5, -0.25, 1.57)),            # the handout
    ('Local pose set to x=1.500, y=-0.250, yaw=90.0 deg', (1.5, -0.25, math.pi / 2.0)),
    ('[INFO] Local pose set to x = 1, y = 2 m, yaw = -45 degrees!', (1.0, 2.0, -math.pi / 4.0)),
    ('local pose set to: x: .5, y: 2e-1, yaw: 90', (0.5, 0.2, math.pi / 2.0)),      # > 2 pi
    ('Local pose set to x=0, y=0, yaw=6.28', (0.0, 0.0, 6.28 - 2.0 * math.pi)),
    ('Local pose set to x=0, y=0, yaw=nan', None), ('Local pose set to the origin', None),
    ('Goal reached!', None)])
def test_the_line_of_a_reset(line, pose):
    found = declared_by(line)
    assert found == pose if pose is None else (
        (found.x, found.y, found.yaw) == pytest.approx(pose, abs=1e-9))
