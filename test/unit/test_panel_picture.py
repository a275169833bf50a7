"""The picture of a robot: the latest of each kind, in the frames that it names."""
import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tb3_labs.control.goal import (
    GAVE_UP, STOPPED, WAITING, WAITING_FOR_CONTROL, GoalState, with_reason)
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.panel.picture import RobotView, Trail

HALF_PI = math.pi / 2.0
#: Poses as a page gets them: with 5 digits of an angle.
QUARTER = 1.5708


@pytest.fixture
def view():
    return RobotView()


def picture(view, now=100.0):
    """As the page reads it: through JSON, which has no NaN."""
    return json.loads(json.dumps(view.picture(now), allow_nan=False))


def summary(view, now=100.0):
    return json.loads(json.dumps(view.summary(now), allow_nan=False))


def test_of_a_robot_that_was_never_heard_nothing_is_known(view):
    assert picture(view) == {
        'odom': None, 'local': None, 'frame': None, 'truth': None, 'goal': None,
        'tolerance': None, 'to_go': None, 'state': '', 'phase': '', 'has_control': None,
        'holder': 'nobody', 'driver': '', 'command': None, 'heading_deg': None,
        'ages': {'imu': None, 'odom': None, 'joy': None}, 'epoch': 0}
    assert summary(view) == {
        'state': '', 'phase': '', 'holder': 'nobody', 'age': None, 'distance': None,
        'local': None, 'goal': None}
    assert not view.is_driving


def test_each_kind_that_was_heard_stands_where_it_belongs(view):
    view.hear_frame(Pose2(0.5, -0.25, HALF_PI), 99.0)
    view.hear_odometry(Pose2(1.0, 2.0, 3.0), 99.5)
    view.hear_local(Pose2(-1.0, -2.0, -3.0), 99.0)
    for kind, value in (('goal', Pose2(3.0, 4.0, 0.0)), ('tolerance', 0.01), ('distance', 0.123456),
                        ('angle', -12.3456), ('state', 'MOVE_FORWARD'), ('has_control', True),
                        ('holder', 'gamepad')):
        view.hear(kind, value, 99.0)
    view.hear('imu', HALF_PI, 99.5)
    view.hear_command('/move_to_goal', 0.12345, -0.5, 99.75)
    assert picture(view) == {
        'odom': [1.0, 2.0, 3.0], 'local': [-1.0, -2.0, -3.0], 'frame': [0.5, -0.25, QUARTER],
        'truth': None, 'goal': [3.0, 4.0, 0.0], 'tolerance': 0.01, 'to_go': [0.1235, -12.3456],
        'state': 'MOVE_FORWARD', 'phase': 'driving', 'has_control': True,
        'holder': 'move_to_goal (it has control)', 'driver': '/move_to_goal',
        'command': [0.1235, -0.5], 'heading_deg': 90.0,
        'ages': {'imu': 0.5, 'odom': 0.5, 'joy': None}, 'epoch': 0}
    assert summary(view) == {
        'state': 'MOVE_FORWARD', 'phase': 'driving', 'holder': 'move_to_goal (it has control)',
        'age': 0.0, 'distance': 0.123, 'local': [-1.0, -2.0, -3.0], 'goal': [3.0, 4.0, 0.0]}


def test_an_angle_of_nothing_has_no_sign(view):
    view.hear('distance', 1.0, 99.0)
    view.hear('angle', -0.00001, 99.0)
    assert str(view.picture(100.0)['to_go'][1]) == '0.0'


# -- words

@pytest.mark.parametrize('words, phase', [
    ('ROTATE_TO_GOAL', 'driving'), ('MOVE_FORWARD', 'driving'), ('ROTATE_TO_FINAL', 'driving'),
    ('GOAL_REACHED', 'reached'), ('waiting: no goal', 'waiting'), ('', ''), ('MOVE_FORWARD ', ''),
    ('stopped: no imu for 0.4 s', 'stopped'), ('gave up: it stands still', 'gave up'),
    ('GOAL_REACHED twice', ''), ('not waiting', '')])
def test_the_phase_is_the_kind_of_the_words(view, words, phase):
    view.hear('state', words, 99.0)
    assert picture(view)['state'] == words and picture(view)['phase'] == phase


def test_every_state_and_every_reason_has_a_phase(view):
    for words in [state.name for state in GoalState] + [WAITING_FOR_CONTROL] + [
            with_reason(word, 'any') for word in (WAITING, STOPPED, GAVE_UP)]:
        view.hear('state', words, 99.0)
        assert view.phase


@pytest.mark.parametrize('has_control, state, drives', [
    (True, 'MOVE_FORWARD', True), (False, 'MOVE_FORWARD', False), (None, 'MOVE_FORWARD', False),
    (True, 'stopped: no imu', False)])
def test_move_to_goal_drives_with_control_and_on_its_way(view, has_control, state, drives):
    view.hear('has_control', has_control, 99.0)
    view.hear('state', state, 99.0)
    assert view.is_driving is drives


# -- who drives

@pytest.mark.parametrize('age, drives', [(0.0, True), (0.5, True), (0.5 + 2.0 ** -20, False)])
def test_a_command_drives_a_robot_for_half_a_second(view, age, drives):
    """As its firmware has it: it stops after 0.5 s without a command."""
    view.hear_command('/pad', 0.1, 0.0, 100.0)
    shown = picture(view, 100.0 + age)
    assert (shown['driver'], shown['command']) == (('/pad', [0.1, 0.0]) if drives else ('', None))


@pytest.mark.parametrize('command, drives', [
    ((-0.1, 0.0), True), ((0.0, 0.1), True), ((-0.0, 0.0), False)])
def test_a_node_that_commands_a_standstill_drives_nothing(view, command, drives):
    view.hear_command('/node', *command, 100.0)
    assert picture(view)['driver'] == ('/node' if drives else '')


def test_of_two_nodes_that_command_the_latest_drives(view):
    view.hear_command('/zebra', 0.2, 0.0, 99.8)
    view.hear_command('/ant', 0.1, 0.0, 99.9)
    assert picture(view)['command'] == [0.1, 0.0] and picture(view)['driver'] == '/ant'
    view.hear_command('/ant', 0.0, 0.0, 99.95)
    assert picture(view)['driver'] == '/zebra'
    view.hear_command('/zebra', 0.0, 0.0, 99.95)
    assert picture(view)['driver'] == ''


def test_the_holder_is_who_has_control_else_who_drives_else_who_is_said_to_hold(view):
    assert picture(view)['holder'] == 'nobody'
    view.hear('holder', 'gamepad', 99.0)
    assert picture(view)['holder'] == 'gamepad'
    view.hear_command('/turtlebot_controller', 0.0, 0.5, 100.0)
    assert picture(view)['holder'] == '/turtlebot_controller'
    view.hear('has_control', True, 99.0)
    assert picture(view)['holder'] == 'move_to_goal (it has control)'
    view.hear('has_control', False, 99.0)
    assert picture(view)['holder'] == '/turtlebot_controller'
    assert picture(view, 110.0)['holder'] == summary(view, 110.0)['holder'] == 'gamepad'


# -- frames

def test_the_true_pose_is_shown_in_odom(view):
    """The axis x of odom points along y of the world. From (1, 2) to (1, 5) there are 3 m along it;
    and to face -x of the world is to face +y of odom."""
    view.hear('truth', (Pose2(1.0, 5.0, math.pi), 50.0), 99.0)
    assert picture(view)['truth'] is None        # where odom lies is not known
    view.hear('origin', Pose2(1.0, 2.0, HALF_PI), 99.0)
    assert picture(view)['truth'] == [3.0, 0.0, QUARTER]


@pytest.mark.parametrize('yaw_deg, shown', [
    (0.0, 0.0), (-90.0, 270.0), (180.0, 180.0), (-180.0, 180.0), (359.94, 359.9), (359.96, 0.0),
    (-1e-15, 0.0), (360.0, 0.0), (-0.06, 359.9), (720.04, 0.0)])
def test_the_heading_is_from_0_to_less_than_360(view, yaw_deg, shown):
    view.hear('imu', math.radians(yaw_deg), 99.0)
    assert picture(view)['heading_deg'] == shown


# -- epochs

@pytest.mark.parametrize('moved, is_new', [
    (Pose2(0.0009), False), (Pose2(yaw=-math.radians(0.09)), False), (Pose2(0.0, -0.0011), True),
    (Pose2(yaw=-math.radians(0.11)), True), (Pose2(0.0008, 0.0008), True)])
def test_a_frame_that_moved_was_declared_anew(view, moved, is_new):
    view.hear_frame(Pose2(1.0, 2.0, math.pi), 99.0)    # the first one is no declaration
    assert picture(view)['epoch'] == 0
    view.hear_local(Pose2(5.0, 5.0), 99.0)
    for _ in range(3):
        view.hear_frame(Pose2(1.0 + moved.x, 2.0 + moved.y, math.pi + moved.yaw), 99.0)
        assert picture(view)['epoch'] == is_new
    assert view.trail_in_local.points == ([] if is_new else [(5.0, 5.0)])


@pytest.mark.parametrize('at', [Pose2(0.0, 0.0, math.pi), Pose2(0.25)])
def test_an_odometry_that_was_zeroed_is_not_a_declaration(view, at):
    """The frame follows: local stays where it is on the floor. The trail in odom ends there."""
    frame = Pose2(0.5, 0.5, 0.1)
    view.hear_odometry(at, 99.0)
    view.hear_frame(frame, 99.0)
    view.hear_local(Pose2(7.0, 7.0), 99.0)
    view.hear_odometry(Pose2(), 99.1)
    view.hear_frame(at.inverse() @ frame, 99.1)
    assert picture(view)['epoch'] == 0
    assert view.trail_in_local.points == [(7.0, 7.0)]
    assert view.trail_in_odom.points == [(0.0, 0.0)]
    view.hear_frame(Pose2(9.0), 99.2)              # a person declares
    assert picture(view)['epoch'] == 1


def test_a_robot_that_drives_between_two_looks_at_the_frame_hides_no_declaration(view):
    """At 0.26 m/s and 1.82 rad/s in 0.2 s: 0.05 m and 21 degrees."""
    for number in range(5):
        view.hear_odometry(Pose2(0.05 * number, 0.0, 0.364 * number), 99.0)
        view.hear_frame(Pose2(float(number)), 99.0)
    assert picture(view)['epoch'] == 4
    assert len(view.trail_in_odom.points) == 5


def test_a_declaration_counts_although_the_odometry_is_younger_than_the_frame(view):
    view.hear_frame(Pose2(), 99.0)
    view.hear_odometry(Pose2(5.0, 5.0, 3.0), 99.1)
    view.hear_frame(Pose2(1.0), 99.2)
    assert picture(view)['epoch'] == 1


# -- trails

def driven(count, step=1.0):
    """The trail of a robot that drove straight on, and turned at each place."""
    trail = Trail()
    for number in range(count):
        for yaw in (0.0, 1.0):
            trail.add(Pose2(step * number, 0.0, yaw))
    return trail


@pytest.mark.parametrize('step, count', [(0.019, 51), (0.021, 101), (-0.021, 101), (1.0, 101)])
def test_points_are_two_centimetres_apart_or_more_and_told_to_the_millimetre(step, count):
    points = driven(101, step).points
    assert len(points) == count
    assert min(math.dist(*pair) for pair in zip(points, points[1:])) >= 0.02
    assert all(round(x, 3) == x for x, _ in points)


def test_a_long_trail_keeps_its_beginning_and_end_and_every_other_point_between():
    assert driven(1000).points == [(float(x), 0.0) for x in range(1000)]
    assert driven(1001).points == [(float(x), 0.0) for x in range(0, 1001, 2)]
    assert len(driven(5000).points) <= 1000 and driven(5000).points[-1] == (4999.0, 0.0)


# -- whatever a node of a student says

@pytest.mark.parametrize('number', [math.nan, math.inf])
def test_a_value_that_is_not_a_number_is_not_shown(view, number):
    """These topics have no check on their way here, and JSON has no such number."""
    for kind in ('distance', 'angle', 'tolerance', 'imu'):
        view.hear(kind, number, 99.0)
    view.hear_command('/node', number, 0.0, 100.0)
    shown = picture(view)
    assert shown['to_go'] is shown['tolerance'] is shown['heading_deg'] is shown['command'] is None
    assert shown['driver'] == '/node'              # it commands something
    assert summary(view)['distance'] is None
    view.hear('distance', 1.0, 99.0)
    view.hear_command('/node', 0.1, number, 100.0)
    assert picture(view)['to_go'] is picture(view)['command'] is None
    view.hear('angle', 2.0, 99.0)
    assert picture(view)['to_go'] == [1.0, 2.0]


@pytest.mark.parametrize('kind', ['imu', 'odom', 'joy'])
def test_the_age_is_the_time_since_the_last_message(view, kind):
    for at in (10.0, 90.0):
        view.hear(kind, 0.0 if kind == 'imu' else Pose2(), at)
    for now, age in ((90.0, 0.0), (90.25, 0.0), (90.375, 0.375), (3690.0, 3600.0)):
        ages = picture(view, now)['ages']
        assert ages.pop(kind) == age        # a stream is read a few times a second
        assert set(ages.values()) == {None}
    for now, age in ((90.5, 0.0), (90.75, 0.75)):
        assert summary(view, now)['age'] == (age if kind == 'odom' else None)


POSES = st.builds(Pose2, *[st.floats(-1e6, 1e6)] * 2, st.floats(-math.pi, math.pi))


@given(st.lists(st.one_of(
    st.tuples(st.sampled_from(['odometry', 'local', 'frame']), POSES),
    st.tuples(st.sampled_from(['goal', 'origin']), POSES),
    st.tuples(st.just('truth'), st.tuples(POSES, st.floats(0.0, 1e9))),
    st.tuples(st.sampled_from(['distance', 'angle', 'tolerance', 'imu']), st.floats()),
    st.tuples(st.just('state'), st.text(max_size=5)),
    st.tuples(st.just('command'), st.tuples(st.floats(), st.floats()))),
    max_size=12))
def test_a_page_can_read_whatever_is_heard(heard):
    view = RobotView()
    for kind, value in heard:
        if kind in ('odometry', 'local', 'frame'):
            getattr(view, 'hear_' + kind)(value, 99.0)
        elif kind == 'command':
            view.hear_command('/node', *value, 99.9)
        else:
            view.hear(kind, value, 99.0)
    shown = picture(view)
    assert shown['heading_deg'] is None or 0.0 <= shown['heading_deg'] < 360.0
    assert 0 <= shown['epoch'] <= sum(kind == 'frame' for kind, _ in heard)
    summary(view)
    json.dumps([view.trail_in_odom.points, view.trail_in_local.points], allow_nan=False)


def test_the_truth_is_that_of_the_odometrys_instant(view):
    """At 0.2 m/s and 0.1 s later the robot is truly 20 mm ahead of its odometry, which is right."""
    view.hear('origin', Pose2(), 99.0)
    view.hear_odometry(Pose2(1.0, 2.0, QUARTER), 99.0)
    view.hear('motion', (50.0, 0.2, 0.0), 99.0)
    view.hear('truth', (Pose2(1.0, 2.02, QUARTER), 50.1), 99.1)
    assert picture(view)['truth'] == [1.0, 2.0, QUARTER]
    view.hear('motion', (50.2, 0.0, 1.0), 99.2)      # turning: it was 0.1 rad less far
    assert picture(view)['truth'] == [1.0, 2.02, round(math.pi / 2 + 0.1, 5)]
    view.hear('truth', (Pose2(1.0, 2.02, QUARTER), 40.0), 99.3)    # too old to be compared
    assert picture(view)['truth'] == [1.0, 2.02, QUARTER]


def test_the_pose_in_local_moves_the_robot_between_two_messages_of_the_odometry(view):
    view.hear_odometry(Pose2(1.0, 1.0, 0.0), 99.0)
    view.hear_frame(Pose2(1.0, 1.0, math.pi / 2), 99.0)
    view.hear_local(Pose2(0.0, -0.05, -math.pi / 2), 99.1, 50.0)
    assert picture(view)['odom'] == [1.05, 1.0, 0.0]     # local's -y is odom's +x
    view.hear_odometry(Pose2(1.06, 1.0, 0.0), 99.2)
    assert picture(view)['odom'] == [1.06, 1.0, 0.0]


def test_a_reset_is_seen_at_once_also_before_the_frame_comes(view):
    view.hear_odometry(Pose2(2.0, 0.0, 0.0), 99.0)
    view.hear_frame(Pose2(), 99.0)
    view.hear_local(Pose2(2.0, 0.0), 99.0, 50.0)
    view.hear_local(Pose2(), 99.1, 50.1)                 # "the robot is at the origin"
    seen = picture(view)
    assert (seen['odom'], seen['local'], seen['frame']) == ([2.0, 0.0, 0.0], [0.0, 0.0, 0.0],
                                                            [2.0, 0.0, 0.0])
    assert seen['epoch'] == 1
    assert view.trail_in_local.points == [(0.0, 0.0)]
    view.hear_frame(Pose2(2.003, 0.0), 99.2)             # the frame itself: not another reset
    seen = picture(view)
    assert (seen['frame'], seen['epoch']) == ([2.003, 0.0, 0.0], 1)
    view.hear_frame(Pose2(1.0, 0.0), 99.4)
    assert picture(view)['epoch'] == 2


def test_a_robot_that_was_silent_while_it_drove_was_not_reset(view):
    view.hear_frame(Pose2(), 99.0)
    view.hear_odometry(Pose2(), 99.0)
    view.hear_local(Pose2(), 99.0)
    view.hear_odometry(Pose2(0.5, 0.0), 99.9)
    view.hear_local(Pose2(0.5, 0.0), 99.9)
    assert picture(view)['epoch'] == 0
    view.hear_odometry(Pose2(), 100.5)                   # the firmware's own reset:
    view.hear_local(Pose2(0.5, 0.0), 100.5)              # the pose in local stays
    assert picture(view)['epoch'] == 0
