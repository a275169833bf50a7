"""Finds faults in the text of a node, such as lines without effect and undefined names.

A right node may have such faults, so students read them only if the node loses points. A text that
is not valid Python has no faults here, since Python itself reports the error.
"""
import ast
import json
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any, Dict, Iterator, List, Tuple

from pyflakes import checker, messages

from tb3_labs.marking.names import is_typo_of
from tb3_labs.marking.text.source_analysis import LARGEST_TEXT, PROCESS_LIMITS, NOT_READ, nodes_of

LINT_PROGRAM = '''import json, sys
del sys.path[0]
from tb3_labs.marking.text.lint import assigned, faults
text = sys.stdin.buffer.read()
print(json.dumps([faults(text), assigned(text)]))
'''
#: The limits of the results.
MOST_NAMES = 200    # variables
MOST_LINES = 6      # lines of a variable
MOST_FAULTS = 4
QUOTED = 60         # characters of a quoted name or line
#: With these names a program can use a variable without writing the variable's name.
DYNAMIC_NAMES = {'exec', 'eval', 'globals', 'locals', 'vars', 'getattr', 'setattr', '__dict__'}
FUNCTIONS = ast.FunctionDef, ast.AsyncFunctionDef

#: The number of a line, and a clause on the line's fault.
LineFault = Tuple[int, str]


def read(path: Path) -> Tuple[List[str], Dict[str, List[int]]]:
    """Returns (sentences on the faults of a program, the result of `assigned`). A process with
    limits reads the program, since it is a stranger's."""
    if not path.is_file() or path.stat().st_size > LARGEST_TEXT:
        return [], {}
    done = subprocess.run(
        [*PROCESS_LIMITS, sys.executable, '-c', LINT_PROGRAM], input=path.read_bytes(), cwd='/',
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    found, lines = json.loads(done.stdout.decode()) if done.returncode == 0 else ([], {})
    return [f'Line {line} of {path.name}: {clause}.' for line, clause in found], lines


def assigned(text: bytes) -> Dict[str, List[int]]:
    """Returns name -> the lines that assign this variable or field. A field of a field also appears
    as FIELD.NAME."""
    lines: Dict[str, List[int]] = {}
    for node in nodes_of(text):
        if isinstance(getattr(node, 'ctx', None), ast.Store) and len(lines) < MOST_NAMES:
            names = [node.id] if isinstance(node, ast.Name) else []
            if isinstance(node, ast.Attribute):
                names = [node.attr]
                if isinstance(node.value, ast.Attribute):
                    names.append(f'{node.value.attr}.{node.attr}')
            for name in names:
                lines.setdefault(name, []).append(node.lineno)
    return {name: sorted(set(at))[:MOST_LINES] for name, at in lines.items()}


def faults(text: bytes) -> List[LineFault]:
    """Returns the first faults in the text of a program."""
    try:
        tree = ast.parse(text)
        found = [*_without_effect(tree, text.decode(errors='replace').split('\n')),
                 *_always_true(tree), *_misspelt(tree), *_of_pyflakes(tree), *_unused(tree)]
    except NOT_READ:
        return []
    first = {clause: line for line, clause in sorted(found, reverse=True)}
    return sorted((line, clause) for clause, line in first.items())[:MOST_FAULTS]


def _without_effect(tree: ast.Module, lines: List[str]) -> Iterator[LineFault]:
    # in a try block, a line with only a name may test if the name exists
    tried = {id(part) for node in ast.walk(tree) if isinstance(node, ast.Try) for part in node.body}
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and id(node) not in tried and isinstance(
                node.value, (ast.Name, ast.Attribute, ast.Compare)):
            is_comparison = isinstance(node.value, ast.Compare)
            why = 'it compares, and nothing is assigned' if is_comparison else 'nothing is called'
            line = lines[node.lineno - 1].strip()[:QUOTED]
            yield node.lineno, f'"{line}" has no effect: {why}'


def _always_true(tree: ast.Module) -> Iterator[LineFault]:
    """Yields each condition that a text after ``or`` makes true: ``letter == 'l' or 'left'``."""
    for node in ast.walk(tree):
        test = getattr(node, 'test', None)
        if isinstance(test, ast.BoolOp) and isinstance(test.op, ast.Or) and any(
                isinstance(part, ast.Constant) and isinstance(part.value, str) and part.value
                for part in test.values):
            yield test.lineno, 'the condition is always true: a text alone after "or" is true'


def _misspelt(tree: ast.Module) -> Iterator[LineFault]:
    """Yields each attribute that is assigned and never read, if an attribute with a similar name is
    read. Attributes such as a Subscriber, which works unread, are left out."""
    working = {
        id(target) for node in ast.walk(tree) if isinstance(node, ast.Assign)
        and isinstance(node.value, ast.Call) and node.value.args
        and getattr(node.value.func, 'attr', getattr(node.value.func, 'id', ''))[:1].isupper()
        for target in node.targets}
    assigned: Dict[str, int] = {}
    read = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and _is_self(node):
            if isinstance(node.ctx, ast.Load):
                read.add('self.' + node.attr)
            elif id(node) not in working:
                assigned.setdefault('self.' + node.attr, node.lineno)
    for name in assigned.keys() - read:
        for near in sorted(read):
            if name[-2:] == near[-2:] and is_typo_of(name, near):
                yield assigned[name], (f'{name[:QUOTED]} is assigned here, and never read; near '
                                       f'it: {near[:QUOTED]}')


def _of_pyflakes(tree: ast.Module) -> Iterator[LineFault]:
    """Yields the undefined names, unused variables and functions defined twice that change the
    behaviour of the program."""
    nodes = list(ast.walk(tree))
    dynamic = DYNAMIC_NAMES & set(_names(tree))
    annotations = [part for node in nodes for part in (
        getattr(node, 'annotation', None), getattr(node, 'returns', None)) if part]
    executed = {(node.lineno, node.id) for node in nodes if isinstance(node, ast.Name)} - {
        (name.lineno, name.id) for part in annotations
        for name in ast.walk(part) if isinstance(name, ast.Name)}
    undecorated = {(node.lineno, node.name) for node in nodes
                   if isinstance(node, FUNCTIONS) and not node.decorator_list}
    read_fields = {node.attr for node in nodes if isinstance(node, ast.Attribute)
                   and _is_self(node) and isinstance(node.ctx, ast.Load)}
    global_names = {target.id for node in tree.body if isinstance(node, ast.Assign)
                    for target in node.targets if isinstance(target, ast.Name)}
    for finding in checker.Checker(tree).messages:
        line, arguments = finding.lineno, finding.message_args
        name = str(arguments[0])[:QUOTED] if arguments else ''
        if isinstance(finding, messages.UndefinedName) and (line, name) in executed and not dynamic:
            yield line, f"name '{name}' is not defined"
        elif isinstance(finding, messages.UnusedVariable) and name in read_fields | global_names:
            yield line, '{} is a local variable here, and never used: {} is another one'.format(
                name, 'self.' + name if name in read_fields else 'the global ' + name)
        elif isinstance(finding, messages.RedefinedWhileUnused):
            first = arguments[1]
            if {(line, name), (first, name)} <= undecorated:
                yield line, f'{name} is defined a second time: that of line {first} is never used'


def _unused(tree: ast.Module) -> Iterator[LineFault]:
    """Yields each function and class that the program never uses. Functions with a decorator and
    methods of a class with a base class are left out, since a library may call them."""
    used = Counter(_names(tree))
    if DYNAMIC_NAMES & set(used):
        return
    methods = [method for node in tree.body if isinstance(node, ast.ClassDef)
               and not node.bases and not node.keywords for method in node.body]
    for node in [*tree.body, *methods]:
        if isinstance(node, (*FUNCTIONS, ast.ClassDef)) and not (
                node.decorator_list or node.name.startswith('__')):
            if used[node.name] == Counter(_names(node))[node.name]:
                kind = 'class' if isinstance(node, ast.ClassDef) else 'function'
                yield node.lineno, f'the {kind} {node.name[:QUOTED]} is never used'


def _names(tree: ast.AST) -> Iterator[str]:
    """Yields all names and attributes that a program reads, and all its strings."""
    for node in ast.walk(tree):
        if isinstance(getattr(node, 'ctx', None), ast.Load):
            yield getattr(node, 'id', getattr(node, 'attr', ''))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value


def _is_self(node: Any) -> bool:
    return isinstance(node.value, ast.Name) and node.value.id == 'self'
