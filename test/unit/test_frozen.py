"""Sensors that repeat themselves although the robot is told to move."""
import pytest

from tb3_labs.supervision.freshness import FROZEN_TIME, DriveFrozenWatch, Freshness, FrozenWatch

DT = 0.05
#: This many looks are longer than FROZEN_TIME.
MANY = round(FROZEN_TIME / DT) + 2


def look(watch, times, source, reading=lambda k: 7, must_change=True):
    """The problem after this number of looks at a source."""
    for k in range(times):
        source.heard(DT * k, reading(k))
        watch.update(source, must_change, DT)
    return watch.problem()


def test_before_the_first_look_there_is_no_problem():
    assert FrozenWatch().problem() == ''


@pytest.mark.parametrize('reading, must_change, frozen', [
    (lambda k: 7, True, True), (lambda k: 7, False, False), (lambda k: k % 2, True, False)])
def test_a_source_that_repeats_itself_though_it_must_change_is_frozen(reading, must_change, frozen):
    problem = look(FrozenWatch(), MANY, Freshness('imu'), reading, must_change)
    assert problem.startswith('imu repeats one reading') if frozen else problem == ''


def test_a_question_changes_nothing():
    watch, source = FrozenWatch(), Freshness('imu')
    assert look(watch, MANY - 4, source) == ''
    assert [watch.problem() for _ in range(100)] == 100 * ['']
    assert look(watch, 6, source) == watch.problem() != ''


def test_the_first_look_finds_nothing_frozen():
    source = Freshness('imu')
    source.heard(0.0, 7)
    source.take_new()
    assert look(FrozenWatch(), 1, source) == ''


def test_an_odometry_that_was_never_heard_does_not_show_the_imu():
    watch = DriveFrozenWatch(Freshness('imu'), Freshness('odom'))
    for _ in range(MANY):
        watch.on_command(0.1, 0.0, DT)
    assert 'odom repeats' in watch.problem() and 'imu says' not in watch.problem()


def test_one_new_reading_or_a_start_ends_it():
    for end in (lambda watch, source: look(watch, 1, source, lambda k: 'new'),
                lambda watch, source: watch.start()):
        watch, source = FrozenWatch(), Freshness('imu')
        assert look(watch, MANY, source)
        end(watch, source)
        assert watch.problem() == ''


@pytest.mark.parametrize('linear, angular, odometry_turns, frozen', [
    (0.1, 0.0, False, ['odom']),           # an odometry that goes straight does not show the IMU
    (0.1, 0.0, True, ['odom', 'imu']),     # it turns by the same IMU
    (0.0, 0.5, False, ['odom', 'imu']),
    (0.0, 0.05, False, []), (0.01, 0.0, True, [])])
def test_in_a_drive_it_depends_on_what_the_robot_is_told(linear, angular, odometry_turns, frozen):
    imu, odometry = Freshness('imu'), Freshness('odom')
    watch = DriveFrozenWatch(imu, odometry)
    watch.on_odometry(0.0)
    for k in range(MANY + 1):
        imu.heard(DT * k, 7)
        odometry.heard(DT * k, 7)
        watch.on_odometry(0.1 * (k + 1) if odometry_turns else 0.0)
        watch.on_command(linear, angular, DT)
    problem = watch.problem()
    assert [name for name in ('odom', 'imu') if name + ' repeats' in problem] == frozen
    watch.start()
    assert watch.problem() == ''
