"""What the marker finds in the text of a submission."""
import pytest

from pages import ROOT
from tb3_labs.marking.trial.source_analysis import MAX_TEXT_BYTES, analyse, text_of

#: The result for a text in which nothing is found.
NOTHING = {'remarks': [], 'assigned': {}}


def test_an_angle_that_is_given_to_a_quaternion_costs_a_remark():
    plain = (ROOT / 'scripts' / 'plain_gamepad.py').read_text()
    assert analyse([plain.encode()])['remarks'] == []
    wrong = plain.replace('orientation.z = math.sin(theta / 2.0)', 'orientation.x = theta')
    assert 'send_set_pose_request' in analyse([wrong.encode()])['remarks'][0]
    right = 'def pose(x, y, z, w):\n p.orientation.z = z\n p.orientation.w = w\ndef at(x, q_z):\n p.orientation.z = q_z'
    assert analyse([right.encode()])['remarks'] == []


# ----- the lines that assign a variable -----

@pytest.mark.parametrize('begin, more, times', [
    ('', '[', MAX_TEXT_BYTES), ('', '[', 10 ** 7), ('1', '-1', 90000), ('', '(a\n)', 40000),
    ('if a: pass\n', 'elif a: pass\n', 15000)])
def test_a_file_that_was_made_to_be_hard_shows_nothing(tmp_path, begin, more, times):
    path = tmp_path / 'node.py'
    path.write_text(begin + more * times)
    assert text_of([str(path)]) == NOTHING


def test_what_is_no_text_of_a_program_shows_nothing(tmp_path):
    assert analyse([b'# coding: nothing\nx', b'\xff\0']) == NOTHING
    (tmp_path / 'link.py').symlink_to('/dev/zero')
    assert text_of([str(tmp_path / 'link.py'), str(tmp_path / 'missing.py'), str(tmp_path)]) == NOTHING


def test_the_lines_that_assign_a_variable_are_known(tmp_path):
    text = b"self.goal_yaw = 1\ngoal_yaw += 2\nself.cmd.angular.z, x = 3, 4\nprint(self.goal_yaw)"
    (tmp_path / 'node').write_bytes(text)
    assert text_of([str(tmp_path / 'node')])['assigned'] == {
        'goal_yaw': [1, 2], 'angular.z': [3], 'z': [3], 'x': [3]}
