"""The picture of a robot has the latest value of each kind."""
import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from known_motion import odometry_sample
from tb3_labs.control.goal_state import (
    GAVE_UP, STOPPED, WAITING, WAITING_FOR_CONTROL, GoalState)
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.panel.robot_view import RobotView
from tb3_labs.robot.samples import OdometrySample

HALF_PI = math.pi / 2.0
#: HALF_PI in a picture, which has 5 digits of an angle.
QUARTER = 1.5708


@pytest.fixture
def view():
    return RobotView()


def picture(view, now=100.0):
    """The picture that the page reads: through JSON, which has no NaN."""
    return json.loads(json.dumps(view.picture(now), allow_nan=False))


def test_the_picture_of_a_silent_robot_is_empty(view):
    assert picture(view) == {
        **dict.fromkeys(['odom', 'local', 'frame', 'truth', 'goal', 'distance',
                         'angle', 'has_control', 'command', 'heading_deg']),
        'state': '', 'phase': '', 'driver': '',
        'ages': {'imu': None, 'odom': None}, 'inside': []}
    assert not view.is_driving


def test_each_kind_of_message_has_an_entry_in_the_picture(view):
    view.on_odometry(odometry_sample(1.0, 2.0, 3.0), 99.5)
    for kind, value in (('frame', Pose2(0.5, -0.25, HALF_PI)), ('local', Pose2(-1.0, -2.0, 0.0000001)),
                        ('goal', Pose2(2.0, 2.0, 0.0)), ('state', 'MOVE_FORWARD'),
                        ('has_control', True)):
        view.on_message(kind, value, 99.0)
    view.on_message('imu', HALF_PI, 99.5)
    view.on_command('/move_to_goal', 0.12345, -0.5, 99.75)
    assert picture(view) == {
        'odom': [1.0, 2.0, 3.0], 'local': [-1.0, -2.0, 0.0], 'frame': [0.5, -0.25, QUARTER],
        'truth': None, 'goal': [2.0, 2.0, 0.0], 'distance': 5.0, 'angle': 0.0,
        'state': 'MOVE_FORWARD', 'phase': 'driving', 'has_control': True,
        'driver': '/move_to_goal', 'command': [0.123, -0.5], 'heading_deg': 90.0,
        'ages': {'imu': 0.5, 'odom': 0.5}, 'inside': []}
    assert str(view.picture(100.0)['angle']) == '0.0'    # -0.0 would be shown with its sign


@pytest.mark.parametrize('words, phase', [
    *[(state.name, 'reached' if state is GoalState.GOAL_REACHED else 'driving')
      for state in GoalState],
    *[(word + ': stopped, waiting', word) for word in (WAITING, STOPPED, GAVE_UP)],
    (WAITING_FOR_CONTROL, 'waiting'), ('', ''), ('MOVE_FORWARD ', ''), ('GOAL_REACHED twice', ''),
    ('not waiting', '')])
def test_the_phase_is_the_kind_of_the_state(view, words, phase):
    view.on_message('state', words, 99.0)
    assert picture(view)['state'] == words and picture(view)['phase'] == phase


@pytest.mark.parametrize('has_control, state, drives', [
    (True, 'MOVE_FORWARD', True), (False, 'MOVE_FORWARD', False), (None, 'MOVE_FORWARD', False),
    (True, 'stopped: no imu', False)])
def test_move_to_goal_drives_with_control_in_a_driving_state(view, has_control, state, drives):
    view.on_message('has_control', has_control, 99.0)
    view.on_message('state', state, 99.0)
    assert view.is_driving is drives


@pytest.mark.parametrize('command, age, drives', [
    ([0.1, 0.0], 0.5, True), ([0.1, 0.0], 0.5 + 2.0 ** -20, False), ([-0.1, 0.0], 0.0, True),
    ([0.0, 0.1], 0.0, True), ([-0.0, 0.0], 0.0, False)])
def test_a_command_moves_the_robot_for_half_a_second(
        view, command, age, drives):
    """The firmware stops the robot after 0.5 s without a command."""
    view.on_command('/pad', *command, 100.0)
    shown = picture(view, 100.0 + age)
    assert (shown['driver'], shown['command']) == (('/pad', command) if drives else ('', None))


def test_the_true_pose_is_shown_in_odom(view):
    """The axis x of odom points along y of the world. So (1, 5) is 3 m along x from the origin (1, 2), and a robot that
    faces -x of the world faces +y of odom."""
    view.on_message('truth', (Pose2(1.0, 5.0, math.pi), 50.0), 99.0)
    assert picture(view)['truth'] is None        # the place of odom is not known
    view.on_message('origin', Pose2(1.0, 2.0, HALF_PI), 99.0)
    assert picture(view)['truth'] == [3.0, 0.0, QUARTER]


def test_the_true_pose_is_moved_to_the_stamp_of_the_odometry(view):
    """At 0.2 m/s and 0.1 s later the robot is truly 20 mm ahead of its odometry, which is right."""
    view.on_message('origin', Pose2(), 99.0)
    view.on_odometry(odometry_sample(1.0, 2.0, QUARTER, stamp=50.0, linear=0.2), 99.0)
    view.on_message('truth', (Pose2(1.0, 2.02, QUARTER), 50.1), 99.1)
    assert picture(view)['truth'] == [1.0, 2.0, QUARTER]
    view.on_odometry(odometry_sample(1.0, 2.0, QUARTER, stamp=50.2, angular=1.0), 99.2)
    assert picture(view)['truth'] == [1.0, 2.02, round(HALF_PI + 0.1, 5)]    # 0.1 rad less far
    view.on_message('truth', (Pose2(1.0, 2.02, QUARTER), 40.0), 99.3)    # too old to be compared
    assert picture(view)['truth'] == [1.0, 2.02, QUARTER]


@pytest.mark.parametrize('yaw_deg, shown', [
    (0.0, 0.0), (-90.0, 270.0), (-180.0, 180.0), (359.94, 359.9), (359.96, 0.0), (-1e-15, 0.0),
    (-0.06, 359.9), (720.04, 0.0)])
def test_the_heading_is_from_0_to_less_than_360(view, yaw_deg, shown):
    view.on_message('imu', math.radians(yaw_deg), 99.0)
    assert picture(view)['heading_deg'] == shown


#: A line of a student's own node, which publishes neither local_pose nor a goal.
LINE = 'Local pose set to x=0.5, y=-1e-05, yaw=1.5707963.'


def test_local_is_computed_from_the_odometry_since_the_line_of_the_last_reset(view):
    """The robot is at (0.5, 0), 90 deg in local. Then it drives 0.15 m, and turns left by 0.5 rad."""
    view.on_log_line(LINE)
    view.on_odometry(odometry_sample(2.0, 3.0, 0.0), 99.0)
    assert picture(view)['local'] is None       # the line came before the odometry
    view.on_log_line(LINE)
    view.on_odometry(odometry_sample(2.15, 3.0, 0.5), 99.1)
    seen = picture(view)
    assert seen['local'] == [0.5, 0.15, round(HALF_PI + 0.5, 5)]
    assert seen['frame'] == [2.0, 3.5, -QUARTER] and seen['distance'] is None
    view.on_message('goal', Pose2(0.5, 1.0, HALF_PI), 99.1)
    seen = picture(view)
    assert (seen['distance'], seen['angle']) == (0.85, round(-math.degrees(0.5), 4))
    view.on_message('local', Pose2(7.0), 99.2)    # the node's own local counts
    assert picture(view)['local'] == [7.0, 0.0, 0.0]


@pytest.mark.parametrize('line', [
    'Local pose set to x=1, y=2, yaw=',
    'Local pose set to x=1e999, y=2, yaw=1', 'Local pose set to x=1, y=2, yaw=1e999',
    'Local pose set to x=nan, y=2, yaw=1', 'Local pose set to x=1-2, y=2, yaw=1', 'set to x=1'])
def test_a_line_without_a_valid_pose_declares_nothing(view, line):
    view.on_odometry(odometry_sample(), 99.0)
    view.on_log_line(line)
    assert picture(view)['local'] is None


@pytest.mark.parametrize('at', [(0.0, 0.0, math.pi), (0.25, 0.0, 0.0)])
def test_a_computed_frame_ends_when_the_odometry_is_zeroed(view, at):
    view.on_odometry(odometry_sample(*at), 99.0)
    view.on_log_line(LINE)
    view.on_odometry(odometry_sample(), 99.1)
    assert picture(view)['frame'] is None


POSES = st.builds(Pose2, *[st.floats(-1e6, 1e6)] * 2, st.floats(-math.pi, math.pi))


@given(st.lists(st.one_of(
    st.tuples(st.just('on_odometry'), st.tuples(st.builds(
        OdometrySample, st.floats(-1e9, 1e9), POSES, st.just(0.2), st.just(-1.0)))),
    st.tuples(st.just('on_command'), st.tuples(st.just('/node'), st.floats(), st.floats())),
    st.tuples(st.just('on_message'), st.tuples(st.sampled_from(['goal', 'origin', 'local', 'frame']), POSES)),
    st.tuples(st.just('on_message'), st.tuples(st.just('truth'), st.tuples(POSES, st.floats(0.0, 1e9)))),
    st.tuples(st.just('on_message'), st.tuples(st.just('imu'), st.floats()))), max_size=12))
def test_every_picture_is_valid_json(heard):
    """A student's node may publish any value, but JSON has no NaN."""
    view = RobotView()
    for method, values in heard:
        getattr(view, method)(*values, 99.9)
        view.on_log_line(LINE)
    shown = picture(view)
    assert shown['heading_deg'] is None or 0.0 <= shown['heading_deg'] < 360.0


def test_the_variables_of_nodes_are_shown_until_a_node_falls_silent(view):
    view.on_variables('/b', [('goal_yaw', '440')], 100.0)
    view.on_variables('/a', [('curr_yaw', '1')], 101.0)
    view.on_variables('/a', [('curr_yaw', '2')], 101.5)
    assert picture(view, 101.5)['inside'] == [{'node': '/a', 'values': [['curr_yaw', '2']]},
                                              {'node': '/b', 'values': [['goal_yaw', '440']]}]
    assert [each['node'] for each in picture(view, 103.0)['inside']] == ['/a']
    assert picture(view, 104.0)['inside'] == []


@pytest.mark.parametrize('control, heard_at, speed, problem', [
    (False, 100.1, 0.0, None), (None, 100.1, 0.0, None), (False, 100.1, 0.2, 'the robot still moves'),
    (True, 100.1, 0.0, 'move_to_goal does not answer'),
    (False, 100.0, 0.0, 'the robot does not answer'), (False, None, 0.0, 'the robot does not answer')])
def test_a_stop_is_confirmed_if_the_robot_stands_without_control(
        view, control, heard_at, speed, problem):
    """The stop comes at 100.0 s. An older odometry does not show that the robot stands."""
    view.on_message('has_control', control, 99.0)
    if heard_at is not None:
        view.on_odometry(OdometrySample(0.0, Pose2(), speed, 0.0), heard_at)
    assert view.stop_problem(100.0) == problem
