"""Finds two properties of a submission in its text, since no trial shows them:

* a function that assigns an angle to an orientation instead of a quaternion,
* the lines that assign each variable.

The text comes from a stranger, so a process with limits reads it.
"""
import ast
import json
import os
import re
import subprocess
import sys
from typing import Any, Dict, Iterable, Iterator, List

from tb3_labs.marking.limits import LIMIT_READER_COMMAND

#: This program prints the result of `analyse` for the files in its arguments.
ANALYSE_FILES = '''import json, sys
del sys.path[0]
from tb3_labs.marking.trial import source_analysis
print(json.dumps(source_analysis.analyse(source_analysis.python_texts(sys.argv[1:]))))
'''
#: A larger file is not read [bytes].
MAX_TEXT_BYTES = 200000
#: ast.parse raises these errors for a text that is not valid Python, or is nested too deeply.
NOT_READ = SyntaxError, ValueError, RecursionError, MemoryError
#: The result has at most MAX_NAMES variables, and at most MAX_LINES lines for each variable.
MAX_NAMES, MAX_LINES = 200, 6
ANGLE_AS_ORIENTATION = 'In {} the angle itself is given to the orientation: a yaw becomes a ' \
    'quaternion by sine and cosine of its half. Y sends 0, so it costs no points.'


def text_of(paths: Iterable[str]) -> Dict[str, Any]:
    """Returns the findings in programs. Each of the `paths` is a program or a folder of programs.

    `remarks` are sentences for the student. `assigned` has the lines that assign each variable; see
    the function `assigned`.
    """
    done = subprocess.run(
        [*LIMIT_READER_COMMAND, sys.executable, '-c', ANALYSE_FILES, *paths], cwd='/',
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, universal_newlines=True)
    return dict(json.loads(done.stdout)) if done.returncode == 0 else analyse([])


def analyse(texts: Iterable[bytes]) -> Dict[str, Any]:
    """Returns the findings in `texts`; see `text_of`."""
    remarks: List[str] = []
    lines: Dict[str, List[int]] = {}
    for text in texts:
        nodes = nodes_of(text)
        remarks += [ANGLE_AS_ORIENTATION.format(node.name) for node in nodes
                    if isinstance(node, ast.FunctionDef) and _gives_angle(node)]
        lines.update(assigned(nodes))
    return {'remarks': remarks, 'assigned': lines}


def nodes_of(text: bytes) -> List[Any]:
    """Returns the nodes of a program's syntax tree, first the module; [] if `text` is not valid
    Python, or nested too deeply."""
    try:
        return list(ast.walk(ast.parse(text)))
    except NOT_READ:
        return []


def assigned(nodes: Iterable[Any]) -> Dict[str, List[int]]:
    """Returns name -> the lines that assign this variable or field. A field of a field has two
    names, NAME and FIELD.NAME."""
    lines: Dict[str, List[int]] = {}
    for node in nodes:
        if isinstance(getattr(node, 'ctx', None), ast.Store) and len(lines) < MAX_NAMES:
            names = [node.id] if isinstance(node, ast.Name) else []
            if isinstance(node, ast.Attribute):
                names = [node.attr]
                if isinstance(node.value, ast.Attribute):
                    names.append(f'{node.value.attr}.{node.attr}')
            for name in names:
                lines.setdefault(name, []).append(node.lineno)
    return {name: sorted(set(at))[:MAX_LINES] for name, at in lines.items()}


def _gives_angle(function: ast.FunctionDef) -> bool:
    """Does a function assign its last argument, an angle, to a field of an orientation? An argument
    with the name of a quaternion's component, such as z or q_w, is not an angle."""
    angle = function.args.args[-1].arg if function.args.args else 'x'
    return not re.fullmatch('(.*q.*)?[xyzw]', angle) and any(
        isinstance(node, ast.Assign) and _dotted_name(node.value) == angle
        and any('.orientation.' in _dotted_name(target) for target in node.targets)
        for node in ast.walk(function))


def _dotted_name(node: Any) -> str:
    """Returns a variable's name, such as `a.b`, without `.data`. Returns '' for an expression."""
    if isinstance(node, ast.Attribute):
        owner = _dotted_name(node.value)
        return owner if node.attr == 'data' else f'{owner}.{node.attr}'
    return node.id if isinstance(node, ast.Name) else ''


def python_texts(paths: Iterable[str]) -> Iterator[bytes]:
    """Yields the text of each program. Each of the `paths` is a program or a folder of programs."""
    for path in paths:
        below = [os.path.join(folder, name) for folder, _, names in os.walk(path)
                 for name in names if name.endswith('.py')]
        for file in below or [path]:
            if os.path.isfile(file) and os.path.getsize(file) <= MAX_TEXT_BYTES:
                with open(file, 'rb') as opened:
                    yield opened.read()
