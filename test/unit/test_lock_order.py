"""The order of locks in move_to_goal: actionlib's first, then the node's own.

actionlib calls the node with its lock held, and the node then takes its own. If the node called
actionlib with its own lock held, both threads could wait for each other for ever. The same holds
for a wait for tf: a thread that waits must not keep the node from driving.
"""
import ast

from pages import ROOT

SCRIPT = ROOT / 'src' / 'tb3_labs' / 'nodes' / 'move_to_goal' / 'ros_node.py'
LOCK = '_changed'
#: The objects whose calls take actionlib's lock, or wait for tf.
NEVER_UNDER_IT = {'_goals', '_frames'}


def own(node):
    """The names x of all expressions self.x in a node."""
    return {each.attr for each in ast.walk(node) if isinstance(each, ast.Attribute)
            and isinstance(each.value, ast.Name) and each.value.id == 'self'}


def called(node):
    """The names x of all calls self.x() and self.x.y() in a node."""
    return {name for call in ast.walk(node) if isinstance(call, ast.Call)
            for name in own(call.func)}


def wrong_calls(source):
    """'method: x' of each call of self.x.y() under the lock, also through other methods."""
    methods = {node.name: node for node in ast.walk(ast.parse(source))
               if isinstance(node, ast.FunctionDef)}
    wrong = []
    for name, method in methods.items():
        used = set()
        for node in ast.walk(method):
            if isinstance(node, ast.With) and any(
                    own(item.context_expr) == {LOCK} for item in node.items):
                used.update(*map(called, node.body))
        for _ in methods:    # as many steps as a way through them can have
            used.update(*(called(methods[each]) for each in used & set(methods)))
        wrong += ['{}: {}'.format(name, each) for each in sorted(used & NEVER_UNDER_IT)]
    return wrong


def test_nothing_of_actionlib_is_called_under_the_nodes_lock():
    source = SCRIPT.read_text()
    assert source.count('with self.{}:'.format(LOCK)) > 3 and 'self._goals.' in source
    assert wrong_calls(source) == []
