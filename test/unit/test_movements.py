"""Movements that are found in the commands alone: a turn, a drive, or driven by hand. Nodes that publish no state:
their drives are found by commands, sensors and resets."""
import math
from dataclasses import replace

import pytest
from made_run import drive, driven, goals, made, resets, states, turn, values, variables

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.recording.run_data import Commands, LogLines, Poses
from tb3_labs.report.motion.drives import drive_reports
from tb3_labs.report.motion.movements import (
    CAME_TO_REST, LAB_GOAL, MovementKind, movements, with_derived_fields)
from tb3_labs.report.motion.resets_and_goals import frame_intervals

#: Any drive of the lab.
DRIVE = drive(2.0, 135.0, 0.8, -135.0)


def kinds(segments, **parts):
    return [movement.kind for movement in movements(driven(segments, **parts))]


def control(*times_and_values):
    return {'control': values(*zip(*times_and_values))}


ARC = [(2.0, 6.0, 0.2, 0.5)]
MOUSE, PAD = {'devices': ('mouse_info',)}, {'devices': ('joy',)}


@pytest.mark.parametrize('parts, segments, kind', [
    # one turn of a drive may be missing
    ({}, DRIVE[:2], MovementKind.DRIVE), ({}, DRIVE[1:], MovementKind.DRIVE), ({}, DRIVE[1:2], MovementKind.BY_HAND),
    # a drive moves the robot by a tenth of a metre
    ({}, drive(2.0, 90.0, 0.09, 90.0), MovementKind.BY_HAND),
    ({}, drive(2.0, 90.0, 0.11, 90.0), MovementKind.DRIVE),
    # if a mouse is there, only a turn faster than the mouse's is a turn, and nothing is a drive
    (MOUSE, [turn(2.0, 90.0, 0.5)], MovementKind.BY_HAND), (MOUSE, [turn(2.0, 90.0, 0.51)], MovementKind.TURN),
    ({}, [turn(2.0, 90.0, 0.5)], MovementKind.TURN), (MOUSE, DRIVE, MovementKind.BY_HAND),
    # a pad without control drives
    (PAD, DRIVE, MovementKind.BY_HAND), (PAD, DRIVE[:1], MovementKind.BY_HAND),
    # with control, whatever the movement
    (control((0.5, 1.0)), ARC, MovementKind.DRIVE), (control((0.5, 0.0), (1.5, 1.0)), ARC, MovementKind.DRIVE),
    (control((0.5, 1.0), (1.5, 0.0)), ARC, MovementKind.BY_HAND),
    # before its first message, control was the other way
    (control((15.0, 0.0)), DRIVE, MovementKind.DRIVE), (control((15.0, 1.0)), DRIVE, MovementKind.BY_HAND),
    (control((0.5, 1.0)), DRIVE[:1], MovementKind.DRIVE)])
def test_the_kind_of_a_movement(parts, segments, kind):
    assert kinds(segments, **parts) == [kind]


@pytest.mark.parametrize('pause, number', [(0.9, 1), (1.1, 3)])
def test_a_pause_of_a_second_ends_a_movement(pause, number):
    assert len(movements(driven(drive(2.0, 135.0, 0.8, -135.0, pause)))) == number


@pytest.mark.parametrize('parts, kinds_now', [
    (control((1.0, 1.0), (5.05, 0.0)), [MovementKind.DRIVE, MovementKind.BY_HAND]),
    (dict(resets=resets((5.05, 0.0, 0.0, 0.0))), [MovementKind.BY_HAND, MovementKind.BY_HAND])])
def test_a_change_of_control_and_a_reset_begin_another_movement(parts, kinds_now):
    found = movements(driven([(2.0, 8.0, 0.2, 0.0)], **parts))
    assert [movement.kind for movement in found] == kinds_now
    assert (found[0].end, found[1].begin, found[1].end) == pytest.approx((5.1, 5.1, 8.0))


def test_a_recorder_that_hears_true_after_the_node_began_splits_no_drive():
    assert kinds(DRIVE, **control((0.1, 0.0), (2.15, 1.0))) == [MovementKind.DRIVE]


def test_a_command_that_is_not_renewed_lasts_for_the_robots_timeout():
    run = driven([(2.0, 2.05, 0.0, 1.0)])
    found, = movements(driven([(2.0, 2.05, 0.0, 1.0)], commands=run.commands.take([0])))
    assert (found.begin, found.end) == pytest.approx((2.0, 2.5))


def test_a_run_without_commands_has_no_movements():
    assert movements(driven([], commands=Commands.none())) == []
    assert movements(driven([(2.0, 3.0, 0.0, 0.0)])) == []


START, OFFSET = (1.0, -0.5, 2.8), 2.45
#: A turn to the left, 0.8 m, and a turn back by 133 deg, so that the robot faces 2 deg at the end.
BACK = drive(2.0, 135.0, 0.8, -133.0)
END = 0.8 * math.cos(math.radians(135.0)), 0.8 * math.sin(math.radians(135.0))


def run_of(segments=BACK, **parts):
    return with_derived_fields(driven(segments, start=START, imu_offset=OFFSET, **parts))


def test_a_drive_by_numbers():
    run = run_of()
    found, = drive_reports(run)
    off = math.hypot(END[0] + 0.61, END[1] - 0.61)
    assert found.goal == LAB_GOAL and found.outcome == CAME_TO_REST
    assert found.error == pytest.approx((off, math.radians(-2.0)), abs=2e-3)
    assert found.true_error == pytest.approx((off, math.radians(-2.0)), abs=2e-3)
    times = math.radians(135.0) / 1.5 + 0.1, 4.0 + 0.1, math.radians(133.0) / 1.5
    assert found.end - found.begin == pytest.approx(sum(times))
    assert found.drift == pytest.approx(0.0, abs=1e-3)
    assert run.derived == ('local_pose', 'frames', 'states', 'goals')


def test_a_reset_during_a_drive_ends_the_drive():
    run = run_of([turn(2.0, 90.0), (3.2, 12.0, 0.2, 0.0)], resets=resets((8.02, 0.0, 0.0, 0.0)),
                 **control((1.0, 1.0)))
    first, second = drive_reports(run)
    assert (first.outcome, second.outcome) == ('reset', CAME_TO_REST)
    assert second.begin == pytest.approx(8.1)


#: When the drive BACK ends [s].
BACK_END = 2.0 + math.radians(135.0 + 133.0) / 1.5 + 4.0 + 0.2


@pytest.mark.parametrize('outcome, parts_at', [
    ('reached', lambda at: dict(printed=states((at, '[INFO] [17.2]: Goal reached!\n')))),
    ('reached', lambda at: dict(log=LogLines.without_stamps([(at, 'info', '/node', 'goal reached')]))),
    ('reached', lambda at: dict(variables=variables(
        time=[1.0, at, at + 0.1], state=['MOVE_FORWARD', 'GOAL_REACHED', 'GOAL_REACHED']))),
    ('reset', lambda at: dict(resets=resets((at, 0.0, 0.0, 0.0)))),
    ('control taken', lambda at: control((0.5, 1.0), (at, 0.0)))])
def test_a_drive_ends_by_what_was_recorded_at_its_end(outcome, parts_at):
    for delay, expected in ((-0.05, outcome), (0.4, outcome), (0.6, CAME_TO_REST)):
        found, = drive_reports(run_of(**parts_at(BACK_END + delay)))
        assert found.outcome == expected, delay


def test_a_drive_that_goes_on_after_goal_reached_does_not_end_by_it():
    found, = drive_reports(run_of(printed=states((BACK_END - 2.0, 'Goal reached!'))))
    assert found.outcome == CAME_TO_REST


def test_a_goal_that_was_typed_is_not_assumed():
    found, = drive_reports(with_derived_fields(driven(BACK), Pose2(1.0, 2.0, 0.0)))
    assert (found.goal, found.is_goal_assumed) == (Pose2(1.0, 2.0, 0.0), False)


def test_a_node_that_sends_tf_alone_has_the_local_pose_of_its_frames():
    run = run_of(resets=resets((12.0, 0.5, -0.2, math.pi / 2.0)))
    again = with_derived_fields(replace(run, local_pose=Poses.none(), derived=()))
    assert again.derived == ('local_pose',) and len(frame_intervals(again)) == 2
    last, expected = again.local_pose.pose(-1), run.local_pose.pose(-1)
    assert (last.x, last.y, last.yaw) == pytest.approx((expected.x, expected.y, expected.yaw))


def test_a_recording_of_the_packages_own_node_stays_as_it_is():
    run = made()
    assert with_derived_fields(run) is run
    run = replace(driven(BACK), goals=goals([0.0], [1.0]))
    assert with_derived_fields(run).derived == ('local_pose', 'frames', 'states')
    assert drive_reports(with_derived_fields(run))[0].goal == Pose2(1.0, 0.0, 0.0)
