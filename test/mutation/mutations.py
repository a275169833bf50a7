"""Small changes of a Python source that a test ought to notice: found by ast, made in its text.

A mutation replaces one piece of the text; the rest stays as it is, line by line. Not drawn, because
no test should notice them: docstrings, strings, annotations, decorators, texts of errors and
`format`, how a picture looks (`LOOKS`, `DRESSING`), and statements whose loss is a NameError at
once.

Units: lines count from 1, columns are bytes from 0, as in ast.
"""
import ast
import re
from dataclasses import dataclass
from typing import Iterator, List, Optional, Tuple

#: (operator, its replacement, kind); a boundary differs in one value only.
COMPARISONS = {
    ast.Lt: ('<', [('<=', 'boundary'), ('>', 'comparison')]),
    ast.LtE: ('<=', [('<', 'boundary'), ('>=', 'comparison')]),
    ast.Gt: ('>', [('>=', 'boundary'), ('<', 'comparison')]),
    ast.GtE: ('>=', [('>', 'boundary'), ('<=', 'comparison')]),
    ast.Eq: ('==', [('!=', 'comparison')]), ast.NotEq: ('!=', [('==', 'comparison')]),
    ast.Is: ('is', [('is not', 'comparison')]), ast.IsNot: ('is not', [('is', 'comparison')]),
    ast.In: ('in', [('not in', 'comparison')]), ast.NotIn: ('not in', [('in', 'comparison')])}
ARITHMETIC = {ast.Add: ('+', '-'), ast.Sub: ('-', '+'), ast.Mult: ('*', '/'), ast.Div: ('/', '*')}
LOGIC = {ast.And: ('and', 'or'), ast.Or: ('or', 'and')}
TWINS = {'min': 'max', 'max': 'min'}
#: A float is changed by this factor.
FACTOR = 1.1
#: Keywords of matplotlib's that say how a picture looks.
LOOKS = {'fontsize', 'linewidth', 'markersize', 'zorder', 'handlelength', 'ncol', 'xytext', 'dpi',
         'bbox_to_anchor', 'shrinkA', 'shrinkB', 'linestyle', 'frameon', 'figsize', 'bbox',
         'arrowprops', 'constrained_layout', 'rotation'}
#: Functions that give a picture its words, its margins and its size, but none of what it shows.
DRESSING = {'set_title', 'set_xlabel', 'set_ylabel', 'grid', 'margins', 'new_figure'}


@dataclass(frozen=True)
class Mutation:
    """One change: `before` becomes `after` at (`line`, `column`) of the file `path`."""

    path: str
    line: int
    column: int
    before: str
    after: str
    kind: str                # comparison, boundary, arithmetic, logic, constant, twin, lost, return

    def in_words(self) -> str:
        """The change, on one line."""
        before, after = (' '.join(text.split()) for text in (self.before, self.after))
        if self.kind == 'lost':
            return 'lost: {}'.format(before)
        return '{} -> {}'.format(before, after)

    def applied(self, source: str) -> str:
        """The file's text with the change; ``ValueError`` where the text is another one."""
        begin = _offset(source, self.line, self.column)
        if not source[begin:].startswith(self.before):
            raise ValueError('{}:{} does not say {!r}'.format(self.path, self.line, self.before))
        return source[:begin] + self.after + source[begin + len(self.before):]


def mutations_of(path: str, source: str) -> List[Mutation]:
    """Every mutation of a file, in the order of its lines."""
    finder = _Finder(path, source)
    finder.visit(ast.parse(source))
    found = [mutation for mutation in finder.found if _is_valid(mutation, source)]
    return sorted(found, key=lambda mutation: (mutation.line, mutation.column, mutation.after))


def _is_valid(mutation: Mutation, source: str) -> bool:
    try:
        ast.parse(mutation.applied(source))
    except SyntaxError:      # a piece of a longer expression that needs brackets
        return False
    return True


def _called(call: ast.Call) -> str:
    """The name of a function or a method, '' for one without."""
    return getattr(call.func, 'attr', getattr(call.func, 'id', ''))


def _offset(source: str, line: int, column: int) -> int:
    lines = source.splitlines(keepends=True)
    in_line = lines[line - 1].encode('utf-8')[:column].decode('utf-8')
    return sum(map(len, lines[:line - 1])) + len(in_line)


class _Finder(ast.NodeVisitor):
    """Walks a file and collects its mutations."""

    def __init__(self, path: str, source: str) -> None:
        self._path, self._source = path, source
        self._function: Optional[str] = None
        self.found: List[Mutation] = []

    # Where nothing is drawn.

    def visit_arg(self, node: ast.arg) -> None:
        """An argument has nothing but its annotation."""

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        """Text."""

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self.visit(node.value)

    def visit_Call(self, node: ast.Call) -> None:
        function = node.func
        if _called(node) in DRESSING | {'format'}:
            return
        name = function.id if isinstance(function, ast.Name) else ''
        if name in TWINS:
            self._replace(function, TWINS[name], 'twin')
        self.visit(function)
        for argument in node.args:
            self.visit(argument)
        for keyword in node.keywords:
            if keyword.arg not in LOOKS:
                self.visit(keyword.value)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        outer, self._function = self._function, node.name
        for default in node.args.defaults + [d for d in node.args.kw_defaults if d is not None]:
            self.visit(default)
        for statement in node.body:
            self.visit(statement)
        self._function = outer

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        for statement in node.body:
            self.visit(statement)

    # Statements.

    def visit_Raise(self, node: ast.Raise) -> None:
        self._lose(node)

    def visit_Expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Call) and _called(node.value) not in DRESSING:
            self._lose(node)
        if not isinstance(node.value, ast.Constant):
            self.visit(node.value)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        self._lose(node)
        self.visit(node.value)
        if type(node.op) in ARITHMETIC:
            sign, other = ARITHMETIC[type(node.op)]
            self._between(node.target, node.value, sign + '=', other + '=', 'arithmetic')

    def visit_Assign(self, node: ast.Assign) -> None:
        kept = all(isinstance(target, (ast.Attribute, ast.Subscript)) for target in node.targets)
        if kept and self._function not in (None, '__init__'):
            self._lose(node)
        self.visit(node.value)

    def visit_Return(self, node: ast.Return) -> None:
        value = node.value
        if value is not None and not (isinstance(value, ast.Constant) and (
                value.value is None or isinstance(value.value, bool))):
            self._replace(value, 'None', 'return')
        self.generic_visit(node)

    def _lose(self, node: ast.AST) -> None:
        if self._function is not None:
            self._replace(node, 'pass', 'lost')

    # Expressions.

    def visit_Compare(self, node: ast.Compare) -> None:
        operands = [node.left] + node.comparators
        for left, operator, right in zip(operands, node.ops, operands[1:]):
            sign, others = COMPARISONS[type(operator)]
            for other, kind in others:
                self._between(left, right, sign, other, kind)
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        is_text = isinstance(node.left, ast.Constant) and isinstance(node.left.value, str)
        if type(node.op) in ARITHMETIC and not is_text:
            self._between(node.left, node.right, *ARITHMETIC[type(node.op)], 'arithmetic')
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        for left, right in zip(node.values, node.values[1:]):
            self._between(left, right, *LOGIC[type(node.op)], 'logic')
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        if isinstance(node.op, (ast.Not, ast.USub)):
            kind = 'logic' if isinstance(node.op, ast.Not) else 'arithmetic'
            self._replace(node, '({})'.format(self._text(node.operand)), kind)
        self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> None:
        value = node.value
        if isinstance(value, bool):
            self._replace(node, str(not value), 'constant')
        elif isinstance(value, int):
            self._replace(node, str(value + 1), 'constant')
        elif isinstance(value, float):
            self._replace(node, repr(value * FACTOR if value else 1.0), 'constant')

    # Text.

    def _text(self, node: ast.AST) -> str:
        begin, end = self._ends(node)
        return self._source[begin:end]

    def _ends(self, node: ast.AST) -> Tuple[int, int]:
        return (_offset(self._source, node.lineno, node.col_offset),
                _offset(self._source, node.end_lineno or 0, node.end_col_offset or 0))

    def _replace(self, node: ast.AST, after: str, kind: str) -> None:
        self.found.append(Mutation(self._path, node.lineno, node.col_offset, self._text(node),
                                   after, kind))

    def _between(self, left: ast.AST, right: ast.AST, before: str, after: str, kind: str) -> None:
        """The operator between two operands."""
        begin, end = self._ends(left)[1], self._ends(right)[0]
        pattern = re.escape(before).replace('\\ ', r'\s+')
        if before[0].isalpha():
            pattern = r'\b' + pattern + r'\b'
        found = re.search(pattern, self._source[begin:end])
        if found is None:
            raise ValueError('{}:{}: no {} found'.format(self._path, left.end_lineno, before))
        start = begin + found.start()
        line = self._source.count('\n', 0, start) + 1
        column = len(self._source[self._source.rfind('\n', 0, start) + 1:start].encode('utf-8'))
        self.found.append(Mutation(self._path, line, column, found.group(), after, kind))


def blocks_of(source: str) -> Iterator[Tuple[int, int, int]]:
    """(line, column, last line) of the first statement of each block inside functions."""
    for function in ast.walk(ast.parse(source)):
        if isinstance(function, ast.FunctionDef):
            for node in ast.walk(function):
                for name in ('body', 'orelse', 'finalbody'):
                    block = getattr(node, name, None)
                    if isinstance(block, list) and block and _begins_a_line(block[0], source):
                        yield block[0].lineno, block[0].col_offset, block[-1].end_lineno


def _begins_a_line(statement: ast.stmt, source: str) -> bool:
    """Not so after a colon, and not for `elif`, which ast takes for an `if` of its own."""
    line = source.splitlines()[statement.lineno - 1]
    return not line[:statement.col_offset].strip() and not line.lstrip().startswith('elif')
