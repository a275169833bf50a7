"""What is told to the instructor, and what is nobody's business."""
import pytest
from tb3_labs.marking.conduct import (UNPROTECTED, changed, for_instructor, laws_imported, listened,
                                      published)
from tb3_labs.marking.marks import Marks
from tb3_labs.marking.observation import MOST_FINDINGS, Observation
from tb3_labs.marking.feedback import feedback, overview

TRUTH = ('/truth_1', '/ground_truth')
INPUTS = {'/mouse_info', '/cmd_vel', '/ctrl_relinq'}


@pytest.mark.parametrize('topic, words', [
    ('/ground_truth', 'true pose'), ('/truth_1', 'true pose'), ('/imu', 'as if it were the robot'),
    ('/odom', 'as if it were the robot'), ('/clock', 'as if it were the robot'),
    ('/joint_states', 'as if it were the robot'), ('/reset', 'own reset'),
    ('/mouse_info', 'the person at the controls'), ('/ctrl_relinq', 'the person at the controls'),
    ('/cmd_vel', ''), ('/tf', ''), ('/my/imu_filtered', ''), ('/joy', '')])
def test_topics_that_a_node_publishes(topic, words):
    said = published('/n', topic, INPUTS, TRUTH)
    assert words in said and bool(words) == bool(said)


@pytest.mark.parametrize('topic, words', [
    ('/ground_truth', 'true pose'), ('/truth_1', 'true pose'), ('/check/x', 'marker alone'),
    ('/turtlebot3/parameter_updates', 'marker alone'), ('/imu', ''), ('/tf', ''),
    ('/turtlebot3_says', '')])
def test_topics_that_a_node_listens_to(topic, words):
    said = listened('/n', topic, TRUTH, {'/turtlebot3', '/check'})
    assert words in said and bool(words) == bool(said)


@pytest.mark.parametrize('code, names', [
    ('from tb3_labs.msg import MouseController', []), ('import tb3_labs.srv', []),
    ('from tb3_labs.srv import ResetPose, SetInitialPose', []), ('import tb3_labs', []),
    ('from tb3_labs import msg', []), ('# from tb3_labs.control import turning', []),
    ("rospack.get_path('tb3_labs')", []), ("print('tb3_labs.')", []),
    ('from tb3_labs.control import turning', ['tb3_labs.control.turning']),
    ('from tb3_labs import control as c, msg', ['tb3_labs.control']),
    ('    import tb3_labs.control.turning', ['tb3_labs.control.turning']),
    ('import_module("tb3_labs.nodes.controller")', ['tb3_labs.nodes.controller'])])
def test_laws_are_found_where_they_are_imported(code, names):
    found = laws_imported('node.py', 'x = 1\n' + code + '\n')
    assert found == ['node.py, line 2, uses {} of this package.'.format(name) for name in names]


def test_settings_that_the_marker_did_not_change():
    before = {'slip': 0.1, 'imu_silent': False, 'seed': 1}
    assert changed(before, dict(before, imu_silent=True), 'setting') == []
    assert changed(before, {'slip': 0.0, 'imu_silent': False, 'more': 2}, 'setting') == [
        'A setting of the robot was changed: more from none to 2.',
        'A setting of the robot was changed: seed from 1 to none.',
        'A setting of the robot was changed: slip from 0.1 to 0.0.']


def test_findings_are_kept_once_and_not_without_end():
    seen = Observation('turn', 'a/b')
    for number in range(100):
        seen.note('')
        seen.note('first')
        seen.note(str(number))
    assert len(seen.findings) == MOST_FINDINGS and seen.findings[:2] == ['first', '0']
    assert Observation.from_json(seen.to_json()).findings == seen.findings


def test_the_instructor_is_told_and_no_student():
    marks = Marks('miller', findings=['It did <that>.'])
    lines = for_instructor([marks, Marks('smith')], {}, {}, unprotected=True)
    assert lines == [UNPROTECTED, 'To look at: miller: It did <that>.']
    assert 'It did &lt;that&gt;.' in overview([marks], 'lab', lines)
    assert 'For the instructor' not in overview([marks], 'lab')
    assert 'that' not in feedback(marks, 'lab').split('<body>')[1]
