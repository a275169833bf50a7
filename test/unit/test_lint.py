"""The faults that the marker finds in the text of a node."""
from unittest.mock import patch

import pytest

from test_criteria import observed, turn
from tb3_labs.marking.text.lint import LARGEST_TEXT, MOST_FAULTS, assigned, faults, read
from tb3_labs.marking.marks import LABS, Marks, marks_after_trial

NODE = '''import rospy
class Controller:
    def __init__(self):
        self.goal_yaw, self.turning, self.state = 0.0, False, 'ROTATE'
        rospy.Subscriber('imu', Imu, self.callback_imu)
    def callback_imu(self, imu):
        {}
        if self.turning and self.state == 'FORWARD':
            print(self.goal_yaw)
    {}
{}
'''
LINE = 7


def told(line='pass', method='', last='Controller()'):
    """Returns the faults of the NODE with these lines."""
    text = NODE.format(line, method, last).replace('rospy\n', 'rospy; from sensor_msgs.msg import Imu\n')
    return faults(text.encode())


@pytest.mark.parametrize('line, words', [
    ('goal_yaw = 90', 'goal_yaw is a local variable here, and never used: self.goal_yaw is another one'),
    ("self.state == 'FORWARD'", '"self.state == \'FORWARD\'" has no effect: it compares, and nothing is assigned'),
    ('rospy.spin', '"rospy.spin" has no effect: nothing is called'),
    ('self.turnning = True', 'self.turnning is assigned here, and never read; near it: self.turning'),
    ("if imu == 'l' or 'left': self.turning = True", 'the condition is always true: a text alone after "or" is true'),
    ('self.goal_yaw = curr_yaw', "name 'curr_yaw' is not defined")])
def test_a_line_is_told_with_its_number(line, words):
    assert told(line) == [(LINE, words)]


def test_an_object_that_works_by_itself_is_only_kept():
    assert told("self.sub = rospy.Subscriber('odom', Imu, print); self.pub = 1; print(self.pub)") == []
    assert len(told('self.sub = Imu(); self.pub = 1; print(self.pub)')) == 1


@pytest.mark.parametrize('method, last, words', [
    ('def callback_imu(self, imu): pass', 'Controller()',
     'callback_imu is defined a second time: that of line 6 is never used'),
    ('def convert_yaw(self, yaw): return yaw + 360.0', 'Controller()', 'the function convert_yaw is never used'),
    ('', 'rospy.spin()', 'the class Controller is never used'),
    ('', 'Controller', '"Controller" has no effect: nothing is called'),
    ('', 'goal = 0\ndef turn():\n    goal = 90\nController(); turn(); print(goal)',
     'goal is a local variable here, and never used: the global goal is another one')])
def test_what_is_defined_and_not_used_is_told(method, last, words):
    (_, said), = told(method=method, last=last)
    assert said == words


@pytest.mark.parametrize('line, method, last', [
    ('unused = imu', '', 'node = Controller()'),                    # no other variable of this name
    ('x: "Optional[int]" = 0; print(x)', 'def f(self) -> "Missing": return self.f()', 'Controller().f()'),
    ('try:\n            raw_input\n        except NameError:\n            pass', '', 'Controller()'),
    ('self.local_x = imu.x; self.local_y = imu.y; print(self.local_x)', '', 'Controller()'),
    ("letter = imu or 'left'; print(letter)", '', 'Controller()'),
    ('"""A text."""; ...', '@property\n    def unused(self): return 0', 'Controller()'),
    ('pass', 'def state_ROTATE(self): return 0', "getattr(Controller(), 'state_' + 'ROTATE')()"),
    ('pass', '', 'from threading import Thread\nclass T(Thread):\n    def run(self): Controller()\nT().start()'),
    ('pass', '', "if rospy:\n    def f(): return 1\nelse:\n    def f(): return 2\nf(); Controller()"),
    ('pass', '', "from math import *\nprint(sqrt(4)); Controller(); print(f'')"),
    ('no (', '', 'Python')])                                        # Python itself reports the error
def test_right_code_is_not_told(line, method, last):
    assert told(line, method, last) == []


def test_few_faults_are_told_the_first_ones():
    text = ''.join('x{}()\n'.format(k // 2) for k in range(100))
    assert [line for line, _ in faults(text.encode())] == list(range(1, 2 * MOST_FAULTS, 2))


@pytest.mark.parametrize('begin, more, times', [
    ('', '[', LARGEST_TEXT), ('', '[', 10 ** 7), ('1', '-1', 90000), ('', '(a\n)', 40000),
    ('if a: pass\n', 'elif a: pass\n', 15000)])
def test_a_file_that_was_made_to_be_hard_has_no_faults(tmp_path, begin, more, times):
    path = tmp_path / 'node.py'
    path.write_text(begin + more * times)
    assert read(path) == ([], {})


def test_what_is_no_text_of_a_program_has_no_faults(tmp_path):
    for text in (b'# coding: nothing\nx', b'\xff\0'):
        assert faults(text) == [] and assigned(text) == {}
    (tmp_path / 'link.py').symlink_to('/dev/zero')
    assert read(tmp_path / 'link.py') == read(tmp_path / 'missing.py') == ([], {})


def test_the_file_is_read_in_a_process_with_limits(tmp_path):
    (tmp_path / 'node.py').write_text('import rospy\nrospy.spin\n')
    assert read(tmp_path / 'node.py') == (
        ['Line 2 of node.py: "rospy.spin" has no effect: nothing is called.'], {})


def test_the_lines_that_assign_a_variable_are_known():
    text = b"self.goal_yaw = 1\ngoal_yaw += 2\nself.cmd.angular.z, x = 3, 4\nprint(self.goal_yaw)"
    assert assigned(text) == {'goal_yaw': [1, 2], 'angular.z': [3], 'z': [3], 'x': [3]}


def test_faults_are_told_with_lost_points_and_an_exception_is_told_once():
    faults_seen = ["Line 7 of node.py: name 'x' is not defined.", 'Line 2 of node.py: a fault.']
    worth = {criterion.name: 1.0 for criterion in LABS['turn'].criteria}
    seen = observed('turn', l=turn(90.0))
    seen.faults = faults_seen
    marks = marks_after_trial(Marks('ann'), seen, 'turn', worth, ['turns'])
    assert marks.remarks[:2] == faults_seen and not marks.is_full
    seen.processes[0].ready, seen.processes[0].ended_by_itself = None, True
    seen.processes[0].printed = "Traceback (most recent call last):\nNameError: name 'x' is not defined\n"
    assert faults_seen[1:] == marks_after_trial(Marks('ann'), seen, 'turn', worth, ['turns']).remarks[:1]
    with patch.object(Marks, 'is_full', True):
        assert marks_after_trial(Marks('ann'), seen, 'turn', worth, ['turns']).remarks == []
