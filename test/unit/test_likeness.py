"""Programs that are the same but for what a copier changes, and programs that are not."""
import pathlib
import random
import re

import pytest
from tb3_labs.marking.conduct import (FEWEST, NEARLY_SAME, likeness, nearly_same, shingles,
                                      tokens_of)

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
    code = '"""Doc."""\n# comment\nx = 3.5  # more\ndef f(a):\n    \'doc\'\n    return a + "s"\n'
    assert tokens_of(code) == [' x', '=', '0', 'def', ' f', '(', ' a', ')', ':', 'return', ' a',
                               '+', "''"]


@pytest.mark.parametrize('change', [
    renamed, lambda code: code.replace('\n', '  # so\n'), lambda code: code.replace('    ', '\t'),
    lambda code: re.sub(r'\b90\b', '180', code),
    lambda code: code.replace("'cmd_vel'", '"/cmd_vel"')])
def test_a_disguise_changes_nothing(change):
    changed = change(TURN)
    assert changed != TURN and alike(TURN, changed) == 1.0


def test_methods_in_another_order_are_nearly_the_same():
    head, *methods = TURN.split('\n    def ')
    last, end = methods[-1].split('\n\n\nif ')
    methods[-1] = last
    random.Random(1).shuffle(methods)
    moved = '\n    def '.join([head] + methods) + '\n\n\nif ' + end
    assert moved != TURN and NEARLY_SAME < alike(renamed(moved), TURN) < 1.0


def test_other_labs_and_own_nodes_are_not_nearly_the_same():
    package = NODES.parents[2]
    nodes = [shingles(path.read_text(encoding='utf-8')) for folder in (NODES, package / 'scripts')
             for path in sorted(folder.glob('*.py'))]
    assert len(nodes) > 12
    assert all(likeness(one, other) < NEARLY_SAME - 0.2 for n, one in enumerate(nodes)
               for other in nodes[:n])


def test_broken_python_is_compared_all_the_same():
    broken = TURN.replace('def turn(self):', 'def turn(self)')
    assert alike(broken + "\n'''", TURN) > NEARLY_SAME


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
