"""The imports of a node: the packages of a submission that it needs, the modules that it lacks."""
import ast
import re
import sys
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Dict, Iterable, List, NamedTuple, Set, Tuple

from tb3_labs.marking.intake.packages import interface_files, is_name

#: If a program catches one of these errors around an import, it runs without the module.
CAUGHT = {'ImportError', 'ModuleNotFoundError', 'Exception', 'BaseException'}
#: A field of a type of another package, as in `geometry_msgs/Pose2D goal`.
FIELD = re.compile(r'^[ \t]*([A-Za-z]\w*)/[A-Za-z]\w*(?:\[\d*\])?\s+\w', re.MULTILINE)
#: The message that the course gives: the skeletons have it, and this package.
GIVEN = 'MouseController'


class Import(NamedTuple):
    """One import statement of a program."""

    modules: Tuple[str, ...]    # with dots, as they are written
    names: Tuple[str, ...]      # what it imports from the module; () for a plain import
    used: bool                  # is an imported name used?
    guarded: bool               # does the program go on if the import fails?

    @property
    def packages(self) -> Set[str]:
        """The modules up to their first dot."""
        return {module.split('.')[0] for module in self.modules}


def imports_of(text: bytes) -> List[Import]:
    """Returns the import statements of a program, in any order; [] if it is not valid Python, or
    too deep.

    Imports of the program's own package (``from . import x``) are left out.
    """
    try:
        nodes = list(ast.walk(ast.parse(text)))
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return []
    used = {node.id for node in nodes if isinstance(node, ast.Name)}
    guarded = {id(inner) for node in nodes if isinstance(node, ast.Try)
               and any(_catches(handler) for handler in node.handlers)
               for statement in node.body for inner in ast.walk(statement)}
    found = []
    for node in nodes:
        if isinstance(node, ast.Import):
            modules = tuple(alias.name for alias in node.names)
            names: Tuple[str, ...] = ()
            bound = {alias.asname or alias.name.split('.')[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            modules, names = (node.module,), tuple(alias.name for alias in node.names)
            bound = {alias.asname or alias.name for alias in node.names}
        else:
            continue
        found.append(Import(modules, names, '*' in bound or bool(bound & used),
                            id(node) in guarded))
    return found


def _catches(handler):
    return handler.type is None or any(
        isinstance(node, ast.Name) and node.id in CAUGHT for node in ast.walk(handler.type))


class Needs(NamedTuple):
    """What a node needs besides the system's modules."""

    packages: List[str]     # of the submission; each one follows the packages that it needs
    given: List[str]        # packages that were not handed in, whose GIVEN the node imports
    unused: List[str]       # modules that are not found, and not used, with dots
    lacking: List[str]      # modules that are not found, up to their first dot


def needs_of(node: Path, packages: Dict[str, Path]) -> Needs:
    """The Needs of a node; `packages`: name -> folder of all packages of the submission.

    The imports of the modules beside the node count too.
    """
    order: List[str] = []
    seen: Set[str] = set()

    def visit(name: str) -> None:
        if name in seen or name not in packages:
            return
        seen.add(name)
        place = packages[name]
        for other in sorted(_types_used(place)):
            visit(other)
        for path in sorted(place.glob('src/{}/**/*.py'.format(name))):
            for imported in _packages_of(imports_of(path.read_bytes())):
                visit(imported)
        order.append(name)

    programs, own = [node], []
    for program in programs:        # modules beside the node are added as they are found
        found = imports_of(program.read_bytes())
        own += [item for item in found if not item.guarded] if program == node else []
        for imported in _packages_of(found):
            visit(imported)
            beside = node.parent / (imported + '.py')
            if beside.is_file() and beside not in programs:
                programs.append(beside)
    offered = {name for name, folder in packages.items()
               if any(interface_files(folder).values()) or (folder / 'setup.py').exists()}
    missing = {name for name in set().union(*(item.packages for item in own)) - offered
               if name not in sys.builtin_module_names
               and PathFinder.find_spec(name, [str(node.parent)] + sys.path) is None}
    given = {name for item in own if GIVEN in item.names and item.modules[0].endswith('.msg')
             for name in item.packages & missing if is_name(name) and name not in packages}
    missing -= given
    lacking = set().union(*(item.packages & missing for item in own if item.used), ())
    return Needs(order + sorted(given), sorted(given), sorted({
        module for item in own for module in item.modules
        if module.split('.')[0] in missing - lacking}), sorted(lacking))


def _packages_of(imports: Iterable[Import]) -> List[str]:
    return sorted(set().union(*(item.packages for item in imports)))


def _types_used(package):
    """The packages whose types are fields of the messages in a package's folder."""
    texts = [(package / kind / name).read_text(encoding='utf-8', errors='replace')
             for kind, names in interface_files(package).items() for name in names]
    return set(FIELD.findall('\n'.join(texts)))
