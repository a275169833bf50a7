"""Finds facts that no trial shows, in the program text of a submission:

* the sign of y in the submission's own mouse client,
* a function that assigns an angle, and not a quaternion, to an orientation,
* the lines that assign each variable.

Because the text comes from a stranger, a process with limited memory and time reads it.
"""
import ast
import json
import math
import os
import re
import subprocess
import sys
from typing import Any, Dict, Iterable, Iterator, List, Set, Tuple

from tb3_labs.marking.limits import LIMIT_READER_COMMAND
from tb3_labs.marking.student_nodes import syntax_nodes_of

#: This program prints the result of `analyse` for the files in its arguments.
ANALYSE_FILES = '''import json, sys
del sys.path[0]
from tb3_labs.marking.trial import source_analysis
print(json.dumps(source_analysis.analyse(source_analysis.python_texts(sys.argv[1:]))))
'''
MAX_TEXT_BYTES = 200000     # a larger file is not read
MAX_NAMES = 200             # the number of variables in the result
MAX_LISTED_LINES = 6        # the number of lines for each variable
#: The call by which a mouse client's program publishes its messages.
PUBLISHES_MOUSE = re.compile(rb'\bPublisher\(\s*(name\s*=\s*)?[\'"]/?mouse_info[\'"]')
Y_NAME = re.compile(r'_*(pos_?)?y(_?pos)?', re.IGNORECASE)      # such as y, _y or pos_y
#: A variable or a function with such a name contains a position in pixels, where y points down.
PIXEL_NAME = re.compile('pos|event|mo[vt]|scroll|click')
#: The result of such a function grows if an argument grows.
GROWING_FUNCTIONS = {'float', 'int', 'round', 'float32', 'Float32', 'min', 'max', 'clip'}
SYNTAX_THAT_GIVES_VALUES = ast.FunctionDef, ast.Assign, ast.AugAssign, ast.keyword
ANGLE_AS_ORIENTATION = (
    'In {} the angle itself is given to the orientation: a yaw becomes a quaternion by sine and '
    'cosine of its half. Y sends 0, so it costs no points.')

#: {variable: slope}. If y of the mouse [pixels] grows, a variable with a positive slope grows, and
#: a variable with a negative slope falls. A constant has the slope 0, an unknown slope is NaN.
Slopes = Dict[str, float]


def read_findings(paths: Iterable[str]) -> Dict[str, Any]:
    """Returns the findings in programs. Each of the `paths` is a program or a folder of programs.

    `mouse_y_sign` is 1 if y points up in the mouse client, -1 if it points down, 0 if this is
    unknown. `remarks` are sentences for the student. `assigned` contains the lines that assign
    each variable.
    """
    done = subprocess.run(
        [*LIMIT_READER_COMMAND, sys.executable, '-c', ANALYSE_FILES, *paths], cwd='/',
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, universal_newlines=True)
    return dict(json.loads(done.stdout)) if done.returncode == 0 else analyse([])


def analyse(texts: Iterable[bytes]) -> Dict[str, Any]:
    """Returns the findings in `texts`; see `read_findings`."""
    y_signs: Set[int] = set()
    remarks: List[str] = []
    lines: Dict[str, List[int]] = {}
    for text in texts:
        nodes = syntax_nodes_of(text)
        if PUBLISHES_MOUSE.search(text):
            # y of a pixel points down, so a sent value that grows with it points down too
            y_signs |= {-1 if slope > 0.0 else 1 for slope in _sent_slopes(nodes)}
        remarks += [ANGLE_AS_ORIENTATION.format(node.name) for node in nodes
                    if isinstance(node, ast.FunctionDef) and _gives_angle(node)]
        lines.update(assigned_lines(nodes))
    y_sign = y_signs.pop() if len(y_signs) == 1 else 0
    return {'mouse_y_sign': y_sign, 'remarks': remarks, 'assigned': lines}


def assigned_lines(nodes: Iterable[Any]) -> Dict[str, List[int]]:
    """Returns {name: the lines that assign this variable or field}. For `self.pose.x` the names are
    `x` and `pose.x`."""
    lines: Dict[str, List[int]] = {}
    for node in nodes:
        is_assigned = isinstance(getattr(node, 'ctx', None), ast.Store)
        if not is_assigned or len(lines) >= MAX_NAMES:
            continue
        if isinstance(node, ast.Name):
            lines.setdefault(node.id, []).append(node.lineno)
        elif isinstance(node, ast.Attribute):
            lines.setdefault(node.attr, []).append(node.lineno)
            if isinstance(node.value, ast.Attribute):
                lines.setdefault(f'{node.value.attr}.{node.attr}', []).append(node.lineno)
    return {name: sorted(set(numbers))[:MAX_LISTED_LINES] for name, numbers in lines.items()}


def _gives_angle(function: ast.FunctionDef) -> bool:
    """Returns True if a function assigns its last argument, an angle, to a field of an orientation.
    An argument that is called like a quaternion's component, such as z or q_w, is not an angle."""
    if not function.args.args:
        return False
    angle = function.args.args[-1].arg
    if re.fullmatch('(.*q.*)?[xyzw]', angle):
        return False
    for node in ast.walk(function):
        if isinstance(node, ast.Assign) and _dotted_name(node.value) == angle:
            if any('.orientation.' in _dotted_name(target) for target in node.targets):
                return True
    return False


def _dotted_name(node: Any) -> str:
    """Returns a variable's name, such as `a.b`, without `.data`; '' for other expressions."""
    if isinstance(node, ast.Attribute):
        owner = _dotted_name(node.value)
        return owner if node.attr == 'data' else f'{owner}.{node.attr}'
    return node.id if isinstance(node, ast.Name) else ''


def _last_name(node: Any) -> str:
    return _dotted_name(node).split('.')[-1]


# -- the sign of y in a mouse client

def _sent_slopes(nodes: List[Any]) -> List[float]:
    """Returns the known slopes of the values that a mouse client assigns to y in a message."""
    slopes = _slopes_of_variables(nodes)
    y_fields = {name for name in slopes if '.' in name and Y_NAME.fullmatch(name.split('.')[-1])}
    read_names = {_dotted_name(node) for node in nodes
                  if isinstance(getattr(node, 'ctx', None), ast.Load)}
    unread_fields = y_fields - read_names    # a client only writes the fields of its message
    sent_slopes = [slopes[name] for name in unread_fields or y_fields]
    return [slope for slope in sent_slopes if slope != 0.0 and not math.isnan(slope)]


def _slopes_of_variables(nodes: List[Any]) -> Slopes:
    assignments: List[Any] = [
        node for node in nodes if isinstance(node, SYNTAX_THAT_GIVES_VALUES)]
    # in Python 3.8 a keyword has no line number
    assignments.sort(key=lambda node: getattr(node, 'lineno', 0) or node.value.lineno)
    slopes: Slopes = {}
    for assignment in assignments * 2:      # a value may be assigned in a line after its first use
        for name, slope in _assigned_slopes(assignment, slopes):
            if name == '':
                continue        # the target is an item of a list, such as buttons[0] = 1
            has_slope = slopes.get(name, 0.0) != 0.0    # True also for NaN
            is_set_back = has_slope and slope == 0.0    # to a constant, which has no slope
            if not is_set_back:
                slopes[name] = slope
    return slopes


def _assigned_slopes(node: Any, slopes: Slopes) -> Iterator[Tuple[str, float]]:
    """Yields (name, slope) for each variable to which a syntax tree node gives a value."""
    if isinstance(node, ast.FunctionDef):       # def on_move(self, x, y)
        slope = 1.0 if PIXEL_NAME.search(node.name) else math.nan
        for parameter in node.args.args:
            if Y_NAME.fullmatch(parameter.arg):
                yield parameter.arg, slope
    elif isinstance(node, ast.keyword):         # MouseController(yPos=...)
        yield f'message.{node.arg}', _slope(node.value, slopes)
    elif isinstance(node, ast.AugAssign):       # y -= 540
        result = ast.BinOp(node.target, node.op, node.value)
        yield _dotted_name(node.target), _slope(result, slopes)
    else:
        for target in node.targets:
            if not isinstance(target, ast.Tuple):
                yield _dotted_name(target), _slope(node.value, slopes)
            elif len(target.elts) > 1:          # `x, y = position` means `y = position[1]`
                second = ast.Subscript(node.value, ast.Constant(1), ast.Load())
                yield _dotted_name(target.elts[1]), _slope(second, slopes)


def _slope(node: Any, slopes: Slopes) -> float:
    """Returns the slope of an expression, with the meaning that the comment on Slopes gives."""
    name = _dotted_name(node)
    if name in slopes:
        return slopes[name]
    if name and not Y_NAME.fullmatch(_last_name(node)):
        return 0.0
    if name:
        owner = getattr(node, 'value', None)        # event in event.y
        return 1.0 if PIXEL_NAME.search(_last_name(owner)) else math.nan
    if isinstance(node, ast.UnaryOp):
        return _sign(node) * _slope(node.operand, slopes)
    if isinstance(node, ast.BinOp):
        left, right = _slope(node.left, slopes), _slope(node.right, slopes)
        if isinstance(node.op, ast.Add):
            return left + right
        if isinstance(node.op, ast.Sub):
            return left - right
        # in a product or a quotient one side depends on y, and the other side gives the sign
        return left * _sign(node.right) + right * _sign(node.left)
    return _slope_of_call_or_item(node, slopes)


def _slope_of_call_or_item(node: Any, slopes: Slopes) -> float:
    owner = node.func if isinstance(node, ast.Call) else getattr(node, 'value', None)
    if PIXEL_NAME.search(_last_name(owner)) and _dotted_name(owner) not in slopes:
        return 1.0      # get_position() or position[1]
    inner_slopes = [_slope(child, slopes) for child in ast.iter_child_nodes(node)]
    if isinstance(node, ast.Subscript) or _last_name(owner) in GROWING_FUNCTIONS:
        return sum(inner_slopes)
    is_constant = all(slope == 0.0 for slope in inner_slopes)   # False for a NaN
    return 0.0 if is_constant else math.nan


def _sign(factor: Any) -> float:
    """Returns -1 if the expression begins with a minus, else 1."""
    return -1.0 if isinstance(getattr(factor, 'op', None), ast.USub) else 1.0


def python_texts(paths: Iterable[str]) -> Iterator[bytes]:
    """Yields the text of each program. Each of the `paths` is a program or a folder of programs."""
    for path in paths:
        programs = [os.path.join(folder, name) for folder, _, names in os.walk(path)
                    for name in names if name.endswith('.py')]
        for file in programs or [path]:
            if os.path.isfile(file) and os.path.getsize(file) <= MAX_TEXT_BYTES:
                with open(file, 'rb') as opened:
                    yield opened.read()
