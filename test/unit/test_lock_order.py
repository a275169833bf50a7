"""The order of locks in move_to_goal: actionlib's first, then the node's own.

actionlib calls the node with its lock held, and the node then takes its own. If the node called
actionlib with its own lock held, both threads could wait for each other for ever. The same holds
for a wait for tf: a thread that waits must not keep the node from driving.
"""
import ast
import pathlib

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / 'scripts' / 'move2goal_tf.py'
LOCK = '_changed'
#: The objects whose calls take actionlib's lock, or wait for tf.
NEVER_UNDER_IT = {'_goals', '_frames'}


def name_of(node):
    """x of the expression self.x, else None."""
    if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and (
            node.value.id == 'self'):
        return node.attr
    return None


def calls(nodes):
    """(x, '') of each call self.x() and (x, y) of each call self.x.y() in the nodes."""
    for top in nodes:
        for node in ast.walk(top):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
                if name_of(node.func):
                    yield node.func.attr, ''
                elif name_of(node.func.value):
                    yield name_of(node.func.value), node.func.attr


def wrong_calls(source):
    """'method: self.x.y' of each call that is made under the lock, also through other methods."""
    methods = {node.name: node for node in ast.walk(ast.parse(source))
               if isinstance(node, ast.FunctionDef)}
    wrong = []
    for name, method in methods.items():
        waiting = [body for node in ast.walk(method) if isinstance(node, ast.With)
                   and any(name_of(item.context_expr) == LOCK for item in node.items)
                   for body in node.body]
        seen = set()
        while waiting:
            for owner, called in calls([waiting.pop()]):
                if owner in NEVER_UNDER_IT:
                    wrong.append('{}: self.{}.{}'.format(name, owner, called))
                elif not called and owner in methods and owner not in seen:
                    seen.add(owner)
                    waiting.append(methods[owner])
    return wrong


def test_nothing_of_actionlib_is_called_under_the_nodes_lock():
    source = SCRIPT.read_text()
    assert source.count('with self.{}:'.format(LOCK)) > 5 and 'self._goals.' in source
    assert wrong_calls(source) == []


def test_a_call_under_the_lock_would_be_found():
    source = '''
class Node:
    def direct(self):
        with self._changed:
            self._goals.ended(1)
    def far(self):
        with self._changed:
            self._near()
    def _near(self):
        self._frames.to_local()
    def allowed(self):
        with self._changed:
            self._core.step()
        self._goals.ended(2)
'''
    assert wrong_calls(source) == ['direct: self._goals.ended', 'far: self._frames.to_local']
