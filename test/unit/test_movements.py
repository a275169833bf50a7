"""Movements that are found in the commands alone: what is a turn, a drive, or driven by hand."""
import math

import pytest
from made_motion import drive, driven, resets, turn, values

from tb3_labs.report.movements import Kind, movements
from tb3_labs.report.run_data import Commands

#: Any drive of the lab.
DRIVE = drive(2.0, 135.0, 0.8, -135.0)


def kinds(segments, **parts):
    return [movement.kind for movement in movements(driven(segments, **parts))]


def test_a_turn_on_the_spot():
    found, = movements(driven([(3.0, 4.0, 0.0, 1.5)]))
    assert found.kind is Kind.TURN
    assert (found.begin, found.forward, found.turns_again, found.end) == pytest.approx(
        (3.0, 4.0, 4.0, 4.0))


def test_a_drive_and_its_three_parts():
    found, = movements(driven(DRIVE))
    first = math.radians(135.0) / 1.5
    assert found.kind is Kind.DRIVE
    assert (found.begin, found.forward, found.turns_again, found.end) == pytest.approx(
        (2.0, 2.1 + first, 6.1 + first, 6.2 + 2.0 * first))


@pytest.mark.parametrize('parts, kind', [
    (DRIVE[:2], Kind.DRIVE), (DRIVE[1:], Kind.DRIVE), (DRIVE[1:2], Kind.BY_HAND),
    (DRIVE[:1], Kind.TURN)])
def test_one_turn_of_a_drive_may_be_missing(parts, kind):
    assert kinds(parts) == [kind]


@pytest.mark.parametrize('pause, number', [(0.9, 1), (1.1, 3)])
def test_a_pause_of_a_second_ends_a_movement(pause, number):
    assert len(movements(driven(drive(2.0, 135.0, 0.8, -135.0, pause)))) == number


@pytest.mark.parametrize('metres, kind', [(0.09, Kind.BY_HAND), (0.11, Kind.DRIVE)])
def test_a_drive_moves_the_robot_by_a_tenth_of_a_metre(metres, kind):
    assert kinds(drive(2.0, 90.0, metres, 90.0)) == [kind]


@pytest.mark.parametrize('degrees, kind', [(19.0, Kind.DRIVE), (21.0, Kind.BY_HAND)])
def test_the_line_of_a_drive_keeps_its_heading(degrees, kind):
    """Both speeds at once: a law that steers a little, or an arc. The first 0.3 s do not count."""
    first = turn(2.0, 90.0)
    arc = first[1], first[1] + 4.3, 0.2, math.radians(degrees) / 4.0
    assert kinds([first, arc]) == [kind]


@pytest.mark.parametrize('rate, kind', [(0.5, Kind.BY_HAND), (0.51, Kind.TURN)])
def test_beside_a_mouse_a_turn_is_faster_than_any_by_the_mouse(rate, kind):
    assert kinds([turn(2.0, 90.0, rate)], devices=('mouse_info',)) == [kind]
    assert kinds([turn(2.0, 90.0, rate)]) == [Kind.TURN]


def test_beside_a_mouse_nothing_is_a_drive():
    assert kinds(DRIVE, devices=('mouse_info',)) == [Kind.BY_HAND]


def test_a_pad_that_never_gave_control_drives():
    assert kinds(DRIVE, devices=('joy',)) == kinds(DRIVE[:1], devices=('joy',)) == [Kind.BY_HAND]


@pytest.mark.parametrize('segments', [DRIVE, DRIVE[:1], [(2.0, 6.0, 0.2, 0.5)]])
@pytest.mark.parametrize('switches, kind', [
    ((1.0,), Kind.DRIVE), ((0.0,), Kind.BY_HAND), ((0.0, 1.0), Kind.DRIVE),
    ((1.0, 0.0), Kind.BY_HAND)])
def test_control_decides_whatever_the_movement(segments, switches, kind):
    control = values([0.5 + k for k in range(len(switches))], switches)
    assert kinds(segments, control=control, devices=('joy',)) == [kind]


@pytest.mark.parametrize('switch, kind', [(0.0, Kind.DRIVE), (1.0, Kind.BY_HAND)])
def test_before_its_first_message_control_was_the_other_way(switch, kind):
    assert kinds(DRIVE, control=values([15.0], [switch])) == [kind]


def test_who_takes_control_begins_another_movement():
    found = movements(driven([(2.0, 8.0, 0.2, 0.0)], control=values([1.0, 5.05], [1.0, 0.0])))
    assert [movement.kind for movement in found] == [Kind.DRIVE, Kind.BY_HAND]
    assert (found[0].end, found[1].begin) == pytest.approx((5.1, 5.1))


def test_a_reset_begins_another_movement():
    found = movements(driven([(2.0, 8.0, 0.2, 0.0)], resets=resets((5.05, 0.0, 0.0, 0.0))))
    assert [(movement.begin, movement.end) for movement in found] == [
        pytest.approx((2.0, 5.1)), pytest.approx((5.1, 8.0))]


def test_a_command_that_is_not_renewed_lasts_for_the_robots_timeout():
    run = driven([(2.0, 2.05, 0.0, 1.0)])
    found, = movements(driven([(2.0, 2.05, 0.0, 1.0)], commands=run.commands.take([0])))
    assert (found.begin, found.end) == pytest.approx((2.0, 2.5))


def test_no_commands_no_movements():
    assert movements(driven([], commands=Commands.none())) == []
    assert movements(driven([(2.0, 3.0, 0.0, 0.0)])) == []
