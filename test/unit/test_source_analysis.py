"""What the marker finds in the text of a submission."""
import sys

import pytest

from pages import ROOT
from tb3_labs.marking.trial.source_analysis import MAX_TEXT_BYTES, analyse, read_findings

#: The result for a text in which nothing is found.
NOTHING = {'mouse_y_sign': 0, 'remarks': [], 'assigned': {}}
CLIENT = '''import rospy
class Mouse:
    def __init__(self):
        self.pub = rospy.Publisher('mouse_info', MouseController, queue_size=1)
    def callback(self, event):
        self.mouse_info.yPos = {}
    def on_move(self, x, y):
        {}
'''
MOVED = 'pass'


@pytest.mark.parametrize('sent, moved, up', [
    # y is a pixel, counted from the upper edge of a screen with 1080 lines; up = 1 means that y = 1 is up
    ('self.y', 'self.y = (540 - y) / 540', 1), ('self.y', 'self.y = y / (self.height / 2) - 1', -1),
    ('-self.y', 'self.y = 2.0 * y / self.height - 1.0', 1), ('self.y', 'self.y = -(y - 540) / float(540)', 1),
    ('self.y', 'y -= 540; self.y = y / -540', 1), ('self.y', 'y *= -1; self.y = max(-1, min(1, y / 540 + 1))', 1),
    ('mouse.position[1] / 540 - 1', MOVED, -1), ('1 - get_position()[1] / 540', MOVED, 1),
    ('0; x, y = pyautogui.position(); self.mouse_info.yPos = 1 - y / 540', MOVED, 1),
    ('0; y = -event.y / 540 + 1; self.mouse_info.yPos.data = y', MOVED, 1),
    ('0; self.pub.publish(MouseController(yPos=(event.y - 540) / 540))', MOVED, -1),
    # the course's own client knows the size of the screen as a pair, and sends zeros at its end
    ('0.0; w, h = pyautogui.size(); self.mouse_info.yPos = event.y / (h / 2) - 1', 'self.mouse_info.yPos = 0.0', -1),
    # the direction is unknown: a helper may count up, a function is unknown, two texts contradict each other
    # an item of a list has no name of its own
    ('self.y', 'buttons[0] = 1; self.y = 1 - y / 540', 1), ('1 - event.y / size[1]', 'size[1] = y', 1),
    ('self.pointer.y', MOVED, 0), ('np.interp(event.y, [0, 1080], [1, -1])', MOVED, 0),
    ('event.y / 540 - 1', 'self.mouse_info.yPosition = 1', -1),
    ('event.y - 2 * event.y', MOVED, 0), ('0', MOVED, 0),
    ('self.y', 'y = np.interp(y, [0, 1080], [1, -1]); self.y = y', 0),
    ('0; x, y = 0, -event.y / 540 + 1; self.mouse_info.yPos = y', MOVED, 0)])
def test_a_mouse_client_counts_up_or_down(sent, moved, up):
    text = CLIENT.format(sent, moved).encode()
    assert analyse([text])['mouse_y_sign'] == up
    assert analyse([text.replace(b'mouse_info', b'pointer')])['mouse_y_sign'] == 0    # another client
    hears = text.replace(b'Publisher', b'Subscriber') + b"        Publisher('cmd_vel', Twist)\n"
    assert analyse([hears])['mouse_y_sign'] == 0      # a controller, which may call the message event
    other = CLIENT.format('event.y', MOVED).encode()
    assert analyse([text, other, b'no ( Python'])['mouse_y_sign'] == (up if up < 0 else 0 if up else -1)


def test_the_text_of_a_submission_is_read_in_a_process_with_limits(tmp_path):
    (tmp_path / 'client.py').write_text(CLIENT.format('event.y - 540', MOVED))
    (tmp_path / 'link.py').symlink_to('/dev/zero')
    (tmp_path / 'deep.py').write_text('-' * 100000 + '1')
    # Python 3.9 crashes at this depth; then the direction of the mouse is unknown, and the marker goes on
    assert read_findings([str(tmp_path)])['mouse_y_sign'] == (0 if sys.version_info[:2] == (3, 9) else -1)


def test_an_angle_that_is_given_to_a_quaternion_costs_a_remark():
    plain = (ROOT / 'scripts' / 'plain_gamepad.py').read_text()
    assert analyse([plain.encode()])['remarks'] == []
    wrong = plain.replace('orientation.z = math.sin(theta / 2.0)', 'orientation.x = theta')
    assert 'send_set_pose_request' in analyse([wrong.encode()])['remarks'][0]
    right = 'def pose(x, y, z, w):\n p.orientation.z = z\n p.orientation.w = w\ndef at(x, q_z):\n p.orientation.z = q_z'
    assert analyse([right.encode()])['remarks'] == []


@pytest.mark.parametrize('begin, more, times', [
    ('', '[', MAX_TEXT_BYTES), ('', '[', 10 ** 7), ('1', '-1', 90000), ('', '(a\n)', 40000),
    ('if a: pass\n', 'elif a: pass\n', 15000)])
def test_a_file_that_was_made_to_be_hard_shows_nothing(tmp_path, begin, more, times):
    path = tmp_path / 'node.py'
    path.write_text(begin + more * times)
    assert read_findings([str(path)]) == NOTHING


def test_what_is_no_text_of_a_program_shows_nothing(tmp_path):
    assert analyse([b'# coding: nothing\nx', b'\xff\0']) == NOTHING
    (tmp_path / 'link.py').symlink_to('/dev/zero')
    assert read_findings([str(tmp_path / 'link.py'), str(tmp_path / 'missing.py'), str(tmp_path)]) == NOTHING


def test_the_lines_that_assign_a_variable_are_known(tmp_path):
    text = b"self.goal_yaw = 1\ngoal_yaw += 2\nself.cmd.angular.z, x = 3, 4\nprint(self.goal_yaw)"
    (tmp_path / 'node').write_bytes(text)
    assert read_findings([str(tmp_path / 'node')])['assigned'] == {
        'goal_yaw': [1, 2], 'angular.z': [3], 'z': [3], 'x': [3]}
