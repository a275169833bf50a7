"""Finds two properties of a submission in its text, since no trial shows them.

The first property is the sign of y in the submission's own mouse client. The second property is a
function that assigns an angle to an orientation instead of a quaternion.

This module is also a program, since the text is a stranger's. :func:`text_of` starts the program
with limits, and the program prints the result of :func:`analyse`.
"""
import ast
import json
import os
import re
import subprocess
import sys
from typing import Any, Dict, Iterable, List, Optional, Set, Union

#: The limits of a process that reads a stranger's text: memory [bytes], processor time [s].
PROCESS_LIMITS = ['prlimit', '--as=1000000000', '--cpu=10', '--core=0']
#: A larger file is not read [bytes].
LARGEST_TEXT = 200000
#: ast.parse raises these errors for a text that is not valid Python, or is nested too deeply.
NOT_READ = SyntaxError, ValueError, RecursionError, MemoryError
#: The name of a variable that holds y.
Y_NAME = re.compile(r'_*(pos_?)?y(_?pos)?', re.IGNORECASE)
#: A variable or a function with such a name has a position in pixels, where y points down.
PIXEL_NAME = re.compile('pos|event|mo[vt]|scroll|click')
#: The results of these functions grow with their arguments.
GROWING_FUNCTIONS = {'float', 'int', 'round', 'float32', 'Float32', 'min', 'max', 'clip'}
#: These syntax tree nodes give a value to a variable or a field.
ASSIGNMENTS = ast.FunctionDef, ast.Assign, ast.AugAssign, ast.keyword
ANGLE_AS_ORIENTATION = 'In {} the angle itself is given to the orientation: a yaw becomes a ' \
    'quaternion by sine and cosine of its half. Y sends 0, so it costs no points.'

#: How a value depends on the pixel's y: 1 if the value grows with y, -1 if it falls, 0 if it does
#: not depend on y, None if this is unknown.
Slope = Optional[int]
#: variable -> the Slope of its value
Slopes = Dict[str, Slope]


def text_of(paths: Iterable[str]) -> Dict[str, Any]:
    """Returns the findings in the programs below the folders `paths`. `up` is 1 if y points up in
    the mouse client, -1 if y points down, 0 if the direction is unknown. `remarks` are sentences
    for the student."""
    done = subprocess.run(
        [*PROCESS_LIMITS, sys.executable, '-I', os.path.abspath(__file__), *paths], cwd='/',
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, universal_newlines=True)
    return dict(json.loads(done.stdout)) if done.returncode == 0 else analyse([])


def analyse(texts: Iterable[bytes]) -> Dict[str, Any]:
    """Returns the findings in `texts`; see `text_of`."""
    sent, remarks = set(), []
    for text in texts:
        nodes = nodes_of(text)
        if _publishes_mouse(nodes):
            sent |= {slope for slope in _slopes_sent(nodes) if slope}
        for node in nodes:
            if isinstance(node, ast.FunctionDef) and node.args.args and _gives_angle(node):
                remarks.append(ANGLE_AS_ORIENTATION.format(node.name))
    return {'up': -sent.pop() if len(sent) == 1 else 0, 'remarks': remarks}


def nodes_of(text: Union[str, bytes]) -> List[Any]:
    """Returns the nodes of a program's syntax tree, first the module; [] if `text` is not valid
    Python, or nested too deeply."""
    try:
        return list(ast.walk(ast.parse(text)))
    except NOT_READ:
        return []


def _publishes_mouse(nodes: List[Any]) -> bool:
    calls = [node for node in nodes
             if isinstance(node, ast.Call) and _last_name(node.func) == 'Publisher']
    arguments = [each for call in calls
                 for each in (*call.args, *(word.value for word in call.keywords))]
    return any(isinstance(each, ast.Constant) and each.value in ('mouse_info', '/mouse_info')
               for each in arguments)


def _gives_angle(function: ast.FunctionDef) -> bool:
    """Does a function assign an angle, its last argument, to a field of an orientation? An argument
    with the name of a quaternion's component, such as z or q_w, is not an angle."""
    angle = function.args.args[-1].arg
    if re.fullmatch('(.*q.*)?[xyzw]', angle):
        return False
    for node in ast.walk(function):
        if isinstance(node, ast.Assign) and _dotted_name(node.value) == angle:
            if any('.orientation.' in _dotted_name(target) for target in node.targets):
                return True
    return False


def _dotted_name(node: Any) -> str:
    """Returns a variable's name, such as `a.b`, without `.data`. Returns '' for an expression.
    """
    if isinstance(node, ast.Attribute):
        return _dotted_name(node.value) + ('' if node.attr == 'data' else '.' + node.attr)
    return node.id if isinstance(node, ast.Name) else ''


def _last_name(node: Any) -> str:
    return _dotted_name(node).split('.')[-1]


def _slopes_sent(nodes: List[Any]) -> List[Slope]:
    """Returns, for each message field to which a mouse client assigns y, the value's Slope."""
    steps: List[Any] = [node for node in nodes if isinstance(node, ASSIGNMENTS)]
    # in Python 3.8 a keyword has no line number
    steps.sort(key=lambda node: getattr(node, 'lineno', 0) or node.value.lineno)
    slopes: Slopes = {}
    for node in steps + steps:      # twice, since the last function may be the mouse's callback
        _follow_assignment(node, slopes)
    sent = {name: slope for name, slope in slopes.items()
            if '.' in name and Y_NAME.fullmatch(name.split('.')[-1])}
    read = {_dotted_name(node) for node in nodes
            if isinstance(getattr(node, 'ctx', None), ast.Load)}
    unread = set(sent) - read       # a client does not read the fields of its message
    return [sent[name] for name in unread or sent]


def _follow_assignment(node: Any, slopes: Slopes) -> None:
    """Add to `slopes` the variables to which a node of ASSIGNMENTS gives a value."""
    if isinstance(node, ast.FunctionDef):
        slope = 1 if PIXEL_NAME.search(node.name) else None
        slopes.update({word.arg: slope for word in node.args.args if Y_NAME.fullmatch(word.arg)})
    elif isinstance(node, ast.keyword):         # MouseController(yPos=...)
        _assign(f'message.{node.arg}', _slope(node.value, slopes), slopes)
    elif isinstance(node, ast.AugAssign):
        result = ast.BinOp(node.target, node.op, node.value)
        _assign(_dotted_name(node.target), _slope(result, slopes), slopes)
    else:
        for target in node.targets:
            if not isinstance(target, ast.Tuple):
                _assign(_dotted_name(target), _slope(node.value, slopes), slopes)
            elif len(target.elts) > 1:          # x, y = position()
                y = _dotted_name(target.elts[1])
                if isinstance(node.value, ast.Tuple):
                    _assign(y, _slope(node.value.elts[1], slopes), slopes)
                else:
                    _assign(y, _pixel_slope(node.value) or 0, slopes)


def _assign(name: str, slope: Slope, slopes: Slopes) -> None:
    # a later constant, such as a reset to 0, does not change a known slope
    if slope != 0 or not slopes.get(name):
        slopes[name] = slope


def _pixel_slope(node: Any) -> Slope:
    """Returns 1 if a variable or a function has a PIXEL_NAME, else None."""
    named = node.func if isinstance(node, ast.Call) else node
    return 1 if PIXEL_NAME.search(_last_name(named)) else None


def _slope(node: Any, slopes: Slopes) -> Slope:
    """Returns the Slope of an expression."""
    name = _dotted_name(node)
    if name:
        if name in slopes:
            return slopes[name]
        is_y = Y_NAME.fullmatch(_last_name(node))
        return _pixel_slope(getattr(node, 'value', None)) if is_y else 0
    if isinstance(node, ast.Subscript):         # position[1]; in Python 3.8 within an ast.Index
        index = getattr(node.slice, 'value', None)
        return _pixel_slope(node.value) if getattr(index, 'value', index) == 1 else None
    if isinstance(node, ast.UnaryOp):
        sign = -1 if isinstance(node.op, ast.USub) else 1
        return _slope_of_sum([(sign, node.operand)], slopes)
    if isinstance(node, ast.Call) and _last_name(node.func) in GROWING_FUNCTIONS:
        return _slope_of_sum([(1, part) for part in node.args], slopes)
    if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Sub)):
        sign = -1 if isinstance(node.op, ast.Sub) else 1
        return _slope_of_sum([(1, node.left), (sign, node.right)], slopes)
    if isinstance(node, ast.BinOp):
        return _slope_of_sum([(_sign_of_factor(node.right, slopes), node.left),
                              (_sign_of_factor(node.left, slopes), node.right)], slopes)
    return 0 if isinstance(node, ast.Constant) else None


def _slope_of_sum(terms: List[Any], slopes: Slopes) -> Slope:
    """Returns the Slope of a sum of `terms`, each (sign, expression)."""
    found: Set[Slope] = set()
    for sign, part in terms:
        slope = _slope(part, slopes)
        if slope != 0:
            found.add(None if slope is None else sign * slope)
    if not found:
        return 0
    return found.pop() if len(found) == 1 else None


def _sign_of_factor(factor: Any, slopes: Slopes) -> int:
    """Returns -1 if a factor that does not depend on y has a minus in front, else 1."""
    return -1 if isinstance(factor, ast.UnaryOp) and not _slope(factor, slopes) else 1


def _python_texts(paths: Iterable[str]) -> Iterable[bytes]:
    for path in paths:
        for folder, _, names in os.walk(path):
            for file in (os.path.join(folder, name) for name in names if name.endswith('.py')):
                if os.path.isfile(file) and os.path.getsize(file) <= LARGEST_TEXT:
                    with open(file, 'rb') as opened:
                        yield opened.read()


if __name__ == '__main__':
    print(json.dumps(analyse(_python_texts(sys.argv[1:]))))
