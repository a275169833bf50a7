"""Finds faults in the text of a node: lines without effect, undefined names, unused functions.

A right node may have such faults, so students read them only if their node loses points. In a file
that is not valid Python no faults are found: Python itself reports its error.
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
from tb3_labs.marking.text.source_analysis import LARGEST_TEXT, LIMITS, NOT_READ, nodes_of

PROGRAM = '''import json, sys
del sys.path[0]
from tb3_labs.marking.text.lint import assigned, faults
text = sys.stdin.buffer.read()
print(json.dumps([faults(text), assigned(text)]))
'''
#: At most this many variables, and lines of a variable, are returned.
MOST_NAMES, MOST_LINES = 200, 6
#: At most this many faults are returned. A name or a line is cut after QUOTED characters.
MOST_FAULTS, QUOTED = 4, 60
#: By these a program may define names that are not in its text.
DYNAMIC = {'exec', 'eval', 'globals', 'locals', 'vars', 'getattr', 'setattr', '__dict__'}
FUNCTIONS = ast.FunctionDef, ast.AsyncFunctionDef

#: The line of a fault, and a clause.
Fault = Tuple[int, str]


def read(path: Path) -> Tuple[List[str], Dict[str, List[int]]]:
    """Returns (sentences on the faults of a program, {variable: lines that assign it}). A process
    with limits reads the program, which is a stranger's."""
    if not path.is_file() or path.stat().st_size > LARGEST_TEXT:
        return [], {}
    done = subprocess.run(
        [*LIMITS, sys.executable, '-c', PROGRAM], input=path.read_bytes(), cwd='/',
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    found, lines = json.loads(done.stdout.decode()) if done.returncode == 0 else ([], {})
    return [f'Line {line} of {path.name}: {words}.' for line, words in found], lines


def assigned(text: bytes) -> Dict[str, List[int]]:
    """Returns {variable: lines that assign it}; a variable is NAME for NAME and self.NAME, or
    FIELD.NAME for a field of a field."""
    lines: Dict[str, List[int]] = {}
    for node in nodes_of(text):
        if isinstance(getattr(node, 'ctx', None), ast.Store) and len(lines) < MOST_NAMES:
            names = [node.id] if isinstance(node, ast.Name) else []
            if isinstance(node, ast.Attribute):
                names = [node.attr] + ([f'{node.value.attr}.{node.attr}'] if isinstance(
                    node.value, ast.Attribute) else [])
            for name in names:
                lines.setdefault(name, []).append(node.lineno)
    return {name: sorted(set(at))[:MOST_LINES] for name, at in lines.items()}


def faults(text: bytes) -> List[Fault]:
    """Returns the first faults in the text of a program."""
    try:
        tree = ast.parse(text)
        found = [*_without_effect(tree, text.decode(errors='replace').split('\n')),
                 *_always_true(tree), *_misspelt(tree), *_of_pyflakes(tree), *_unused(tree)]
    except NOT_READ:
        return []
    first = {words: line for line, words in sorted(found, reverse=True)}
    return sorted((line, words) for words, line in first.items())[:MOST_FAULTS]


def _without_effect(tree: ast.Module, lines: List[str]) -> Iterator[Fault]:
    # in a try block such a line may ask whether a name exists
    tried = {id(part) for node in ast.walk(tree) if isinstance(node, ast.Try) for part in node.body}
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and id(node) not in tried and isinstance(
                node.value, (ast.Name, ast.Attribute, ast.Compare)):
            yield node.lineno, '"{}" has no effect: {}'.format(
                lines[node.lineno - 1].strip()[:QUOTED], 'it compares, and nothing is assigned'
                if isinstance(node.value, ast.Compare) else 'nothing is called')


def _always_true(tree: ast.Module) -> Iterator[Fault]:
    """Yields conditions such as ``if letter == 'l' or 'left':``."""
    for node in ast.walk(tree):
        test = getattr(node, 'test', None)
        if isinstance(test, ast.BoolOp) and isinstance(test.op, ast.Or) and any(
                isinstance(part, ast.Constant) and isinstance(part.value, str) and part.value
                for part in test.values):
            yield test.lineno, 'the condition is always true: a text alone after "or" is true'


def _misspelt(tree: ast.Module) -> Iterator[Fault]:
    """Yields each attribute that is assigned and never read, if an attribute of a similar name is
    read. An object that works by itself, such as a Subscriber, need not be read."""
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


def _of_pyflakes(tree: ast.Module) -> Iterator[Fault]:
    """Yields three kinds of pyflakes' findings, if they change what the program does."""
    nodes = list(ast.walk(tree))
    dynamic = DYNAMIC & set(_names(tree))
    run = {(node.lineno, node.id) for node in nodes if isinstance(node, ast.Name)} - {
        (name.lineno, name.id) for node in nodes for part in (
            getattr(node, 'annotation', None), getattr(node, 'returns', None)) if part
        for name in ast.walk(part) if isinstance(name, ast.Name)}
    plain = {(node.lineno, node.name) for node in nodes
             if isinstance(node, FUNCTIONS) and not node.decorator_list}
    own = {node.attr for node in nodes if isinstance(node, ast.Attribute) and _is_self(node)
           and isinstance(node.ctx, ast.Load)}
    everywhere = {target.id for node in tree.body if isinstance(node, ast.Assign)
                  for target in node.targets if isinstance(target, ast.Name)}
    for finding in checker.Checker(tree).messages:
        name, line = str(
            finding.message_args[0])[:QUOTED] if finding.message_args else '', finding.lineno
        if isinstance(finding, messages.UndefinedName) and (line, name) in run and not dynamic:
            yield line, f"name '{name}' is not defined"
        elif isinstance(finding, messages.UnusedVariable) and name in own | everywhere:
            yield line, '{} is a local variable here, and never used: {} is another one'.format(
                name, 'self.' + name if name in own else 'the global ' + name)
        elif isinstance(finding, messages.RedefinedWhileUnused):
            first = finding.message_args[1]
            if {(line, name), (first, name)} <= plain:
                yield line, f'{name} is defined a second time: that of line {first} is never used'


def _unused(tree: ast.Module) -> Iterator[Fault]:
    """Yields the functions and classes whose names stand nowhere outside of their own text. A
    function with a decorator, and a method of a class with a base class, may be used elsewhere."""
    used = Counter(_names(tree))
    if DYNAMIC & set(used):
        return
    methods = [method for node in tree.body if isinstance(node, ast.ClassDef)
               and not node.bases and not node.keywords for method in node.body]
    for node in [*tree.body, *methods]:
        if isinstance(node, (*FUNCTIONS, ast.ClassDef)) and not (
                node.decorator_list or node.name.startswith('__')):
            if used[node.name] == Counter(_names(node))[node.name]:
                yield node.lineno, '{} {} is never used'.format(
                    'the class' if isinstance(node, ast.ClassDef) else 'the function',
                    node.name[:QUOTED])


def _names(tree: ast.AST) -> Iterator[str]:
    """Yields all names, attributes and strings that a text reads."""
    for node in ast.walk(tree):
        if isinstance(getattr(node, 'ctx', None), ast.Load):
            yield getattr(node, 'id', getattr(node, 'attr', ''))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value


def _is_self(node: Any) -> bool:
    return isinstance(node.value, ast.Name) and node.value.id == 'self'
