"""Findings for the instructor, and behaviour that is not one; programs that are alike."""
import pathlib
import random
import re

import pytest
from tb3_labs.marking.conduct import (FEWEST, NEARLY_SAME, UNPROTECTED, changed, for_instructor,
                                      likeness, listened, nearly_same, published, shingles,
                                      tokens_of)
from tb3_labs.marking.feedback import feedback, overview
from tb3_labs.marking.imports import laws_named
from tb3_labs.marking.marks import Marks
from tb3_labs.marking.observation import MOST_FINDINGS, Observation

TRUTH = ('/truth_1', '/ground_truth')
INPUTS = {'/mouse_info', '/cmd_vel', '/ctrl_relinq'}


@pytest.mark.parametrize('topic, as_sender, as_listener', [
    ('/ground_truth', 'its true pose', 'true pose'), ('/truth_1', 'its true pose', 'true pose'),
    ('/imu', 'as if it were the robot', ''), ('/odom', 'as if it were the robot', ''),
    ('/clock', 'as if it were the robot', ''), ('/joint_states', 'as if it were the robot', ''),
    ('/reset', 'own reset', ''), ('/mouse_info', 'the person at the controls', ''),
    ('/cmd_vel', '', ''), ('/tf', '', ''), ('/my/imu_filtered', '', ''), ('/joy', '', ''),
    ('/check/x', '', 'marker alone'), ('/turtlebot3/parameter_updates', '', 'marker alone'),
    ('/turtlebot3_says', '', '')])
def test_topics_that_a_node_publishes_or_listens_to(topic, as_sender, as_listener):
    for said, words in ((published('/n', topic, INPUTS, TRUTH), as_sender),
                        (listened('/n', topic, TRUTH, {'/turtlebot3', '/check'}), as_listener)):
        assert words in said and bool(words) == bool(said)


@pytest.mark.parametrize('code, names', [
    ('from tb3_labs.msg import MouseController', []), ('import tb3_labs.srv', []),
    ('from tb3_labs.srv import ResetPose, SetInitialPose', []), ('import tb3_labs', []),
    ('from tb3_labs import msg', []), ('# from tb3_labs.control import turning', []),
    ("rospack.get_path('tb3_labs')", []), ("print('tb3_labs.')", []),
    ('from tb3_labs.control import turning', ['tb3_labs.control.turning']),
    ('from tb3_labs import control as c, msg', ['tb3_labs.control']),
    ('import tb3_labs.control.turning', ['tb3_labs.control.turning']),
    ('from tb3_labs.nodes import (\n    controller)', ['tb3_labs.nodes.controller']),
    ('import_module("tb3_labs.nodes.controller")', ['tb3_labs.nodes.controller'])])
def test_laws_are_found_where_they_are_named(code, names):
    found = laws_named('node.py', 'x = 1\n' + code + '\n')
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


# -- programs that are alike

NODES = pathlib.Path(__file__).resolve().parents[1] / 'ros' / 'student_nodes'
TURN = (NODES / 'turtlebot_controller.py').read_text(encoding='utf-8')
#: Names of the node's own; those of ROS stay, or it would not run.
OWN_NAMES = {'yaw': 'heading', 'goal': 'target', 'error': 'e', 'control': 'steer', 'turn': 'rotate'}


def alike(one, other):
    return likeness(shingles(one), shingles(other))


def renamed(code):
    for old, new in OWN_NAMES.items():
        code = re.sub(r'\b{}\b'.format(old), new, code)
    return code


def test_tokens_have_no_comments_docstrings_or_values():
    code = '"""Doc."""\n# comment\nx = 3.5 + .5  # so\ndef f(a):\n    \'doc\'\n    return a + "s"\n'
    assert tokens_of(code) == [' x', '=', '0', '+', '0', 'def', ' f', '(', ' a', ')', ':',
                               'return', ' a', '+', "''"]


@pytest.mark.parametrize('change', [
    renamed, lambda code: code.replace('\n', '  # so\n'), lambda code: code.replace('    ', '\t'),
    lambda code: re.sub(r'\b90\b', '180', code),
    lambda code: code.replace("'cmd_vel'", '"/cmd_vel"')])
def test_a_disguise_changes_nothing(change):
    changed = change(TURN)
    assert changed != TURN and alike(TURN, changed) == 1.0


def test_broken_python_with_methods_in_another_order_is_nearly_the_same():
    head, *methods = TURN.split('\n    def ')
    last, end = methods[-1].split('\n\n\nif ')
    methods[-1] = last
    random.Random(1).shuffle(methods)
    moved = '\n    def '.join([head] + methods) + '\n\n\nif ' + end
    broken = renamed(moved) + "\n'''"
    assert moved != TURN and NEARLY_SAME < alike(broken, TURN) < 1.0


def test_other_labs_and_own_nodes_are_not_nearly_the_same():
    package = NODES.parents[2]
    nodes = [shingles(path.read_text(encoding='utf-8')) for folder in (NODES, package / 'scripts')
             for path in sorted(folder.glob('*.py'))]
    assert len(nodes) > 12
    assert all(likeness(one, other) < NEARLY_SAME - 0.2 for n, one in enumerate(nodes)
               for other in nodes[:n])


def test_short_texts_tell_nothing():
    short = 'a = b\n' * 3
    assert len(shingles('x = y + z * w\n' * 100)) < FEWEST
    assert alike(short, short) == alike(TURN, '') == alike('', '') == 0.0


def test_what_everybody_was_given_does_not_count():
    # two nodes that have a long text in common, and nothing else
    other = (NODES / 'move2goal_tf.py').read_text(encoding='utf-8')
    given = '\n'.join((NODES.parent / name).read_text(encoding='utf-8')
                      for name in ('turn_test.py', 'gamepad_test.py'))
    texts = {'a': given + TURN, 'b': given + other}
    assert [pair[:2] for pair in nearly_same(texts, {})] == [('a', 'b')]
    assert nearly_same(texts, {}, [given]) == []
    copied = dict(texts, c=given + renamed(TURN))
    assert [pair[:2] for pair in nearly_same(copied, {}, [given])] == [('a', 'c')]


def test_pairs_are_told_once_the_most_alike_first():
    other = (NODES / 'gamepad.py').read_text(encoding='utf-8')
    half = TURN.replace('self.cmd_pub', 'self.publisher.of').replace(
        'self.turning', 'self.now.turning') + other
    found = nearly_same({'b': renamed(TURN), 'a': TURN, 'c': other}, {'own': half, 'own too': TURN})
    assert [pair[:2] for pair in found[:3]] == [('a', 'b'), ('a', 'own too'), ('b', 'own too')]
    assert ('c', 'own') in [pair[:2] for pair in found]
    assert not any({'own', 'own too'} == set(pair[:2]) for pair in found)
