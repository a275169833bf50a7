"""The imports of a program: its statements, the needed ones, and modules of this package.

Programs are only read, as texts.
"""
import ast
import re
from typing import List, NamedTuple, Set, Tuple

#: A module of this package; those that every node may import begin as in SHARED.
LAW = re.compile(r'tb3_labs\.\w[\w.]*')
SHARED = ('tb3_labs.msg.', 'tb3_labs.srv.')
#: If a program catches one of these errors around an import, it runs without the module.
CAUGHT = {'ImportError', 'ModuleNotFoundError', 'Exception', 'BaseException'}


class Import(NamedTuple):
    """One import statement of a program."""

    modules: Tuple[str, ...]    # with dots, as they are written
    first: int                  # its lines, counted from 1
    last: int
    used: bool                  # is an imported name used, or is it not alone on its line?
    guarded: bool               # does the program go on if the import fails?

    @property
    def packages(self) -> Set[str]:
        """The modules up to their first dot."""
        return {module.split('.')[0] for module in self.modules}


def _nodes_of(text):
    """All nodes of a program's syntax tree; [] if its syntax is wrong, or too deep."""
    try:
        return list(ast.walk(ast.parse(text)))
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return []


def imports_of(text: str) -> List[Import]:
    """Returns the import statements of a program, in order; [] if it is not valid Python.

    Imports of the program's own package (``from . import x``) are left out.
    """
    nodes = _nodes_of(text)
    used = {node.id for node in nodes if isinstance(node, ast.Name)}
    guarded = {id(inner) for node in nodes if isinstance(node, ast.Try)
               and any(_catches(handler) for handler in node.handlers)
               for statement in node.body for inner in ast.walk(statement)}
    simple = [node for node in nodes
              if isinstance(node, ast.stmt) and not hasattr(node, 'body')]
    found = []
    for node in nodes:
        if isinstance(node, ast.Import):
            modules = tuple(alias.name for alias in node.names)
            bound = {alias.asname or alias.name.split('.')[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            modules = (node.module,)
            bound = {alias.asname or alias.name for alias in node.names}
        else:
            continue
        first, last = node.lineno, node.end_lineno or node.lineno
        # an import beside another statement in one line cannot be taken out alone
        alone = sum(other.lineno <= last and first <= (other.end_lineno or other.lineno)
                    for other in simple) == 1
        found.append(Import(modules, first, last, not alone or '*' in bound or bool(bound & used),
                            id(node) in guarded))
    return sorted(found, key=lambda item: item.first)


def _catches(handler):
    return handler.type is None or any(
        isinstance(node, ast.Name) and node.id in CAUGHT for node in ast.walk(handler.type))


def laws_named(file: str, text: str) -> List[str]:
    """The findings on a Python file that names more of this package than its messages.

    A module is imported, or named in quotes, as importlib takes it.
    """
    found = []
    for node in _nodes_of(text):
        if isinstance(node, ast.ImportFrom):
            names = ['{}.{}'.format(node.module, alias.name) for alias in node.names]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            names = [node.value]
        else:
            continue
        found += ['{}, line {}, uses {} of this package.'.format(file, node.lineno, name)
                  for name in names if LAW.fullmatch(name)
                  and not (name + '.').startswith(SHARED)]
    return list(dict.fromkeys(found))
