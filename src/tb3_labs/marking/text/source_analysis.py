"""Finds two things in the text of a submission that no trial shows: the sign of y in its own mouse
client, and an angle that is given to an orientation in place of a quaternion.

The text is a stranger's. So this module is also a program: :func:`text_of` starts it with limits,
and it prints what :func:`analyse` returns.
"""
import ast
import json
import os
import re
import subprocess
import sys
from typing import Any, Dict, Iterable, List, Optional

#: The limits of a program that reads a stranger's text: memory [bytes], processor time [s]. The
#: largest file that is read [bytes].
LIMITS, LARGEST_TEXT = ['prlimit', '--as=1000000000', '--cpu=10', '--core=0'], 200000
#: ast.parse raises these for a text that is not valid Python, or too deep.
NOT_READ = SyntaxError, ValueError, RecursionError, MemoryError
#: The names of y. The names of a mouse's place on the screen, whose y counts down.
Y_NAME = re.compile(r'_*(pos_?)?y(_?pos)?', re.IGNORECASE)
PIXEL = re.compile('pos|event|mo[vt]|scroll|click')
#: The result of these functions grows with each argument.
GROWING = {'float', 'int', 'round', 'float32', 'Float32', 'min', 'max', 'clip'}
THETA = 'In {} the angle itself is given to the orientation: a yaw becomes a quaternion by sine ' \
    'and cosine of its half. Y sends 0, so it costs no points.'

#: variable -> does it grow (1) or fall (-1) with the pixel's y? 0 if it does not depend on y, None
#: if it is not known.
Slopes = Dict[str, Optional[int]]


def text_of(paths: Iterable[str]) -> Dict[str, Any]:
    """Returns what the programs in these folders show. `up` is 1 if y counts up in the mouse
    client, -1 if y counts down, 0 if this is unknown. `remarks` are sentences for the student."""
    done = subprocess.run(
        [*LIMITS, sys.executable, '-I', os.path.abspath(__file__), *paths], stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL, cwd='/', universal_newlines=True)
    return dict(json.loads(done.stdout)) if done.returncode == 0 else analyse([])


def analyse(texts: Iterable[bytes]) -> Dict[str, Any]:
    """Returns what these texts show; see `text_of`."""
    downs, remarks = set(), []
    for text in texts:
        nodes = nodes_of(text)
        if any(isinstance(part, ast.Constant) and part.value in ('mouse_info', '/mouse_info')
               for node in nodes if isinstance(node, ast.Call) and _last(node.func) == 'Publisher'
               for part in (*node.args, *(word.value for word in node.keywords))):
            downs |= {slope for slope in _slopes_sent(nodes) if slope}
        remarks += [THETA.format(node.name) for node in nodes if isinstance(
            node, ast.FunctionDef) and node.args.args and _gives_angle(node)]
    return {'up': -downs.pop() if len(downs) == 1 else 0, 'remarks': remarks}


def nodes_of(text: bytes) -> List[Any]:
    """Returns the nodes of a program's syntax tree; [] if the program is not valid."""
    try:
        return list(ast.walk(ast.parse(text)))
    except NOT_READ:
        return []


def _gives_angle(function: ast.FunctionDef) -> bool:
    """Does a function assign its last argument to a field of an orientation, though the name of the
    argument is not that of a quaternion's number, such as z or q_w?"""
    angle = function.args.args[-1].arg
    return not re.fullmatch('(.*q.*)?[xyzw]', angle) and any(
        isinstance(node, ast.Assign) and _dotted(node.value) == angle
        and any('.orientation.' in _dotted(target) for target in node.targets)
        for node in ast.walk(function))


def _dotted(node: Any) -> str:
    """Returns the dotted name of a variable, without `.data`; '' for another expression."""
    if isinstance(node, ast.Attribute):
        return _dotted(node.value) + ('' if node.attr == 'data' else '.' + node.attr)
    return node.id if isinstance(node, ast.Name) else ''


def _last(node: Any) -> str:
    return _dotted(node).split('.')[-1]


def _slopes_sent(nodes: List[ast.AST]) -> List[Optional[int]]:
    """Returns the slopes of y in the messages of a mouse client; see Slopes."""
    steps = sorted((node for node in nodes if isinstance(node, (
        ast.FunctionDef, ast.Assign, ast.AugAssign, ast.keyword))),
        key=lambda node: getattr(node, 'lineno', 0) or getattr(node, 'value').lineno)
    slopes: Slopes = {}

    def assign(name: str, slope: Optional[int]) -> None:
        if slope != 0 or not slopes.get(name):      # a constant only begins or ends the variable
            slopes[name] = slope

    for node in steps + steps:      # the callback that reads the mouse may be the last function
        if isinstance(node, ast.FunctionDef):
            slopes.update({word.arg: int(bool(PIXEL.search(node.name))) or None
                           for word in node.args.args if Y_NAME.fullmatch(word.arg)})
        elif isinstance(node, ast.keyword):         # MouseController(yPos=...)
            assign(f'message.{node.arg}', _slope(node.value, slopes))
        elif isinstance(node, ast.AugAssign):
            assign(_dotted(node.target), _slope(
                ast.BinOp(node.target, node.op, node.value), slopes))
        else:
            for target in node.targets:
                second = isinstance(target, ast.Tuple) and target.elts[1:2]     # x, y = position()
                if second and isinstance(node.value, ast.Tuple):
                    assign(_dotted(second[0]), _slope(node.value.elts[1], slopes))
                elif second:        # another pair, such as a size
                    assign(_dotted(second[0]), _pixel(node.value) or 0)
                elif not isinstance(target, ast.Tuple):
                    assign(_dotted(target), _slope(node.value, slopes))
    sent = {name: slope for name, slope in slopes.items()
            if '.' in name and Y_NAME.fullmatch(name.split('.')[-1])}
    read = {_dotted(node) for node in nodes if isinstance(getattr(node, 'ctx', None), ast.Load)}
    return [sent[name] for name in set(sent) - read or sent]


def _pixel(node: Any) -> Optional[int]:
    """Returns 1 for an expression that reads a mouse's place on the screen, by its name; else None.
    """
    return int(bool(PIXEL.search(_last(node.func if isinstance(node, ast.Call) else node)))) or None


def _slope(node: Any, slopes: Slopes) -> Optional[int]:
    """Returns the slope of an expression; see Slopes."""
    def of(*signed: Any) -> Optional[int]:
        """Returns the slope of a sum of (sign, part)."""
        found = {sign * slope if slope else slope for sign, slope in (
            (sign, _slope(part, slopes)) for sign, part in signed)} - {0}
        return 0 if not found else found.pop() if len(found) == 1 else None
    if _dotted(node):
        is_y = Y_NAME.fullmatch(_last(node))
        return slopes.get(_dotted(node), _pixel(getattr(node, 'value', None)) if is_y else 0)
    if isinstance(node, ast.Subscript):         # position[1]; in Python 3.8 within an ast.Index
        index = getattr(node.slice, 'value', None)
        return _pixel(node.value) if getattr(index, 'value', index) == 1 else None
    if isinstance(node, ast.UnaryOp):
        return of((-1 if isinstance(node.op, ast.USub) else 1, node.operand))
    if isinstance(node, ast.Call):
        return of(*((1, part) for part in node.args)) if _last(node.func) in GROWING else None
    if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Sub)):
        return of((1, node.left), (-1 if isinstance(node.op, ast.Sub) else 1, node.right))
    if isinstance(node, ast.BinOp):             # the sizes of a screen are positive
        left, right = (-1 if isinstance(part, ast.UnaryOp) and not _slope(part, slopes) else 1
                       for part in (node.left, node.right))
        return of((right, node.left), (left, node.right))
    return 0 if isinstance(node, ast.Constant) else None


def _texts(paths: Iterable[str]) -> Iterable[bytes]:
    for path in paths:
        for folder, _, names in os.walk(path):
            for file in (os.path.join(folder, name) for name in names if name.endswith('.py')):
                if os.path.isfile(file) and os.path.getsize(file) <= LARGEST_TEXT:
                    with open(file, 'rb') as opened:
                        yield opened.read()


if __name__ == '__main__':
    print(json.dumps(analyse(_texts(sys.argv[1:]))))
