"""The handouts' own text has the numbers, names and words of handout.py. Another goal is one edit."""
import json
import re
import subprocess
import sys

import pytest
from pages import ROOT

from tb3_labs import handout
from tb3_labs.marking.names import GAMEPAD, IMU, LAB_NODES, MOVE2GOAL, TURN

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
        assert 'self.goal_yaw = 0.0\n' in (ROOT / path).read_text(encoding='utf-8') and handout.GOAL_YAW_DEG == 0.0


def test_the_labs_topics_are_those_of_the_handout():
    assert [LAB_NODES[lab].sensors for lab in (IMU, TURN, MOVE2GOAL, GAMEPAD)] == [
        (handout.IMU_TOPIC,), (handout.IMU_TOPIC,), (handout.ODOM_TOPIC, handout.IMU_TOPIC), (handout.JOY_TOPIC,)]


def test_no_other_module_defines_the_goal_and_the_printed_words():
    texts = {path.name: path.read_text(encoding='utf-8') for path in (ROOT / 'src').rglob('*.py')}
    for words in ('0.61', handout.IMU_GOODBYE, handout.CONTROLLER_GOODBYE, handout.PRINTED_RESET,
                  handout.PRINTED_REACHED,
                  'Current heading'):
        assert [name for name, text in texts.items() if words in text] == ['handout.py'], words


# ----- another goal -----

#: The names in the line that marking.md tells an instructor to edit, and another line with whole numbers.
NAMES = 'GOAL_X, GOAL_Y, GOAL_YAW_DEG'
ANOTHER = NAMES + ' = 1, 1.5, 90'
#: A process with the edited handout prints what the rooms do.
EDITED = r'''
import json, re, sys, types
from pathlib import Path
from types import SimpleNamespace
import tb3_labs
path, line, pattern = sys.argv[1:]
text, number = re.subn(pattern, line, Path(path).read_text(encoding='utf-8'), flags=re.MULTILINE)
tb3_labs.handout = sys.modules['tb3_labs.handout'] = types.ModuleType('tb3_labs.handout')
exec(text, vars(tb3_labs.handout))

import math, numpy as np
from test_criteria import missed_of, observation, stimulus
from test_movements import run_of
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.labs import move2goal, ros_move2goal
from tb3_labs.nodes.move_to_goal.core import MoveToGoalConfig
from tb3_labs.report.motion.drives import drives
from tb3_labs.watch.drive_states import own_pose
from tb3_labs.watch.variables import Series

given = []

# the stimulus of a drive
stage = SimpleNamespace(recorder=SimpleNamespace(pose=Pose2()),
                        motion=lambda name, act, reaction, quiet, seconds, facts, is_astray: given.append(facts))
ros_move2goal.Control.drive(SimpleNamespace(_trial=stage, give=None), move2goal.FIRST_DRIVE)
facts = dict(given[0], moved=True, rested=True)

def judged(x, y, yaw):
    seen = observation('move2goal', stimuli=[stimulus(move2goal.FIRST_DRIVE, facts=facts)],
                       truth=[[0.0, 0.0, 0.0, 0.0], [2.0, x, y, yaw]])
    return [missed_of('move2goal', name, seen) for name in ('goal_place', 'goal_heading')]

# a node that has no variables but its pose, at the origin
zero = Series('zero', np.array([0.0, 1.0]), np.array(['0', '0']), np.array([0.0, 0.0]))
own = own_pose(SimpleNamespace(variable=lambda name: zero if name.startswith('local') else None,
                               run=SimpleNamespace(starts=(0.0,))), np.array([0.5]))
reported, first = drives(run_of())[0].goal, MoveToGoalConfig().goal
MoveToGoalConfig(goal_x=0.5, goal_yaw_deg=0.5)      # they are not whole numbers
print(json.dumps({
    'edits': number, 'stimulus': facts['goal'], 'at the goal': judged(1.0, 1.5, math.pi / 2.0),
    'elsewhere': judged(-0.61, 0.61, 0.0), 'criteria': [each.meaning for each in move2goal.CRITERIA if each.name in (
        'goal_place', 'goal_heading', 'second_heading')],
    'report': [reported.x, reported.y, reported.yaw], 'node': [first.x, first.y, first.yaw],
    'watch': [own.to_goal[0].real, own.to_goal[0].imag, own.goal_yaw[0]]}))
'''


def test_another_goal_for_the_class_is_one_edit():
    recipe = (ROOT / 'doc' / 'instructor' / 'marking.md').read_text(encoding='utf-8')
    assert '**Another goal for the class**: edit the line `{}` in `src/tb3_labs/handout.py`.'.format(NAMES) in recipe
    answer = subprocess.run(
        [sys.executable, '-c', EDITED, handout.__file__, ANOTHER, '^{} = .*$'.format(NAMES)], check=True,
        cwd=str(ROOT / 'test' / 'unit'), stdout=subprocess.PIPE, universal_newlines=True, timeout=120.0).stdout
    seen, goal = json.loads(answer), pytest.approx([1.0, 1.5, 1.5707963267948966])
    assert seen['edits'] == 1
    assert seen['stimulus'] == goal and seen['report'] == goal and seen['watch'] == goal and seen['node'] == goal
    assert seen['at the goal'] == ['', '']
    assert seen['elsewhere'] == ['it stopped 1.84 m from the goal', 'at the end it faced 0.0 degrees instead of 90']
    assert seen['criteria'] == ['drives to (1, 1.5)', 'faces 90 degrees there', 'faces 90 degrees of the new frame']
