"""The handouts' own text has the numbers, names and words of handout.py. Another goal is one edit."""
import re

import pytest
from pages import ROOT

from tb3_labs import handout
from tb3_labs.marking.student_nodes import GAMEPAD, IMU, LAB_NODES, MOVE2GOAL, TURN

#: The node's file -> parts of its text, with the names of handout.py
OWN_TEXT = {
    'scripts/imu_sub.py': ["Subscriber('{IMU_TOPIC}'", '"{IMU_GOODBYE}"'],
    'doc/skeletons/imu/src/imu_sub.py': ['"{IMU_GOODBYE}"'],
    'scripts/plain_turtlebot_controller.py': [
        'K_HDG = {K_HDG:g} ', 'HDG_TOL = {HDG_TOL:g} ', 'MIN_ANG_Z = {MIN_ANG_Z:g} ', 'MAX_ANG_Z = {MAX_ANG_Z:g} ',
        'self.curr_yaw + {TURN_DEG:g}\n', 'self.curr_yaw - {TURN_DEG:g}\n', 'direction == "{LEFT_KEY}"',
        'direction == "{RIGHT_KEY}"', 'abs(mouse_info.yPos) > {MOUSE_DEAD_ZONE:g}', ' {MOUSE_FULL:g} * mouse_info.yPos',
        'abs(mouse_info.xPos) > {MOUSE_DEAD_ZONE:g}', '-{MOUSE_FULL:g} * mouse_info.xPos',
        "'{IMU_TOPIC}'", "'{MOUSE_INFO_TOPIC}'", "'{CMD_VEL_TOPIC}'", '"{CONTROLLER_GOODBYE}"'],
    'doc/skeletons/turn/src/turtlebot_controller.py.in': [
        '"Input {LEFT_KEY} or {RIGHT_KEY} to turn {TURN_DEG:g} deg"', 'abs(mouse_info.yPos) > {MOUSE_DEAD_ZONE:g}',
        ' {MOUSE_FULL:g} * mouse_info.yPos', '"{CONTROLLER_GOODBYE}"'],
    'scripts/plain_move2goal_tf.py': [
        'self.goal_x = {GOAL_X}\n', 'self.goal_y = {GOAL_Y}\n', "if self.state == '{ROTATE_TO_GOAL}'",
        "self.state == '{MOVE_FORWARD}'", "self.state == '{ROTATE_TO_FINAL}'", "self.state == '{GOAL_REACHED}'",
        'abs(yaw_error) > {ANGLE_TOLERANCE:g}:\n                cmd.angular.z = {GAIN_TO_GOAL:g} * yaw_error',
        'abs(yaw_error) > {ANGLE_TOLERANCE:g}:\n                cmd.angular.z = {GAIN_TO_FINAL:g} * yaw_error',
        'distance > {DISTANCE_TOLERANCE:g}:\n                cmd.linear.x = {DRIVE_SPEED:g}\n',
        "'{CMD_VEL_TOPIC}'", "'{ODOM_TOPIC}'", "'{SET_POSE_SERVICE}'", "'{CTRL_RELINQ_TOPIC}'",
        "'{PRINTED_REACHED}!'", "{PRINTED_POSE_SET} to x="],
    'doc/skeletons/move2goal/src/move2goal_tf.py': [
        'self.goal_x = {GOAL_X}\n', 'self.goal_y = {GOAL_Y}\n', "'{PRINTED_REACHED}!'", "{PRINTED_POSE_SET} to x="],
    'scripts/plain_gamepad.py': [
        'cmd.linear.x = {MAX_LINEAR_SPEED:g} * msg.axes[{LINEAR_AXIS}]',
        'cmd.angular.z = {MAX_ANGULAR_SPEED:g} * msg.axes[{ANGULAR_AXIS}]',
        'if msg.buttons[{BUTTON_A}]:\n            self.has_control = False',
        'if msg.buttons[{BUTTON_B}]:\n            self.has_control = True',
        'if msg.buttons[{BUTTON_Y}]:\n            self.send_set_pose_request',
        "'{JOY_TOPIC}'", "'{CTRL_RELINQ_TOPIC}'", "'{SET_POSE_SERVICE}'", "'{PRINTED_RESET}.'"],
    'doc/skeletons/gamepad/src/gamepad.py': ["'{PRINTED_RESET}.'"]}


@pytest.mark.parametrize('path', sorted(OWN_TEXT))
def test_the_handouts_own_text_has_the_same_values(path):
    text = re.sub(r'(?<!\d)\.(?=\d)', '0.', (ROOT / path).read_text(encoding='utf-8'))      # .25 is 0.25
    assert [part for part in OWN_TEXT[path] if part.format(**vars(handout)) not in text] == []


def test_the_line_of_a_heading_and_the_heading_at_the_goal():
    for path in 'scripts/imu_sub.py', 'doc/skeletons/imu/src/imu_sub.py':
        assert handout.PRINTED_HEADING.format('%f') in (ROOT / path).read_text(encoding='utf-8')
    for path in 'scripts/plain_move2goal_tf.py', 'doc/skeletons/move2goal/src/move2goal_tf.py':
        assert 'self.goal_yaw = 0.0 ' in (ROOT / path).read_text(encoding='utf-8') and handout.GOAL_YAW_DEG == 0.0


def test_the_labs_topics_are_those_of_the_handout():
    assert [LAB_NODES[lab].needed_topics for lab in (IMU, TURN, MOVE2GOAL, GAMEPAD)] == [
        (handout.IMU_TOPIC,), (handout.IMU_TOPIC,), (handout.ODOM_TOPIC, handout.IMU_TOPIC), (handout.JOY_TOPIC,)]


def test_no_other_module_defines_the_goal_and_the_printed_words():
    texts = {path.name: path.read_text(encoding='utf-8') for path in (ROOT / 'src').rglob('*.py')}
    for words in ('0.61', handout.IMU_GOODBYE, handout.CONTROLLER_GOODBYE, handout.PRINTED_RESET,
                  handout.PRINTED_REACHED,
                  'Current heading'):
        assert [name for name, text in texts.items() if words in text] == ['handout.py'], words


def test_another_goal_for_the_class_is_one_edit():
    """marking.md names the line; no other module has its numbers."""
    names = 'GOAL_X, GOAL_Y, GOAL_YAW_DEG'
    recipe = (ROOT / 'doc' / 'instructor' / 'marking.md').read_text(encoding='utf-8')
    assert '**Another goal for the class**: edit the line `{}` in `src/tb3_labs/handout.py`.'.format(names) in recipe
    lines = (ROOT / 'src' / 'tb3_labs' / 'handout.py').read_text(encoding='utf-8').splitlines()
    assert [line.partition(' = ')[0] for line in lines if 'GOAL_X' in line] == [names]
