"""What does a program import, and which of it is used?"""
import ast
from typing import List, NamedTuple, Set, Tuple

#: Whoever catches one of these in a try around an import goes on without the module.
CAUGHT = {'ImportError', 'ModuleNotFoundError', 'Exception', 'BaseException'}


class Import(NamedTuple):
    """One import statement of a program."""

    modules: Tuple[str, ...]    # with dots, as they are written
    first: int                  # its lines, counted from 1
    last: int
    used: bool                  # is a name that it binds used, or does it share its line?
    guarded: bool               # does the program go on if the import fails?

    @property
    def packages(self) -> Set[str]:
        """The modules up to their first dot."""
        return {module.split('.')[0] for module in self.modules}


def imports_of(text: str) -> List[Import]:
    """The import statements of a program, in order; none if its syntax is wrong, or too deep.

    Imports of the program's own package (``from . import x``) are left out.
    """
    try:
        tree = ast.parse(text)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return []
    used = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    guarded = {id(inner) for node in ast.walk(tree) if isinstance(node, ast.Try)
               and any(_catches(handler) for handler in node.handlers)
               for statement in node.body for inner in ast.walk(statement)}
    simple = [(node.lineno, node.end_lineno or node.lineno) for node in ast.walk(tree)
              if isinstance(node, ast.stmt) and not hasattr(node, 'body')]
    found = []
    for node in ast.walk(tree):
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
        alone = sum(begin <= last and first <= end for begin, end in simple) == 1
        found.append(Import(modules, first, last, not alone or '*' in bound or bool(bound & used),
                            id(node) in guarded))
    return sorted(found, key=lambda item: item.first)


def _catches(handler):
    if handler.type is None:
        return True
    return bool({node.id for node in ast.walk(handler.type) if isinstance(node, ast.Name)} & CAUGHT)


def without(text: str, imports: List[Import]) -> str:
    """The program without these imports; each line of them becomes a comment, so that the numbers
    of the other lines stay."""
    lines = text.splitlines(True)
    for item in imports:
        indent = lines[item.first - 1][:len(lines[item.first - 1])
                                       - len(lines[item.first - 1].lstrip())]
        for number in range(item.first - 1, item.last):
            lines[number] = '{}{}# {}'.format(
                indent, 'pass    ' if number == item.first - 1 else '', lines[number].lstrip())
    return ''.join(lines)
