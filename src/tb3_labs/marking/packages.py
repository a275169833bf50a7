"""The packages of a submission, the imports of its programs, and the packages that a node needs.

All files are only read, as texts.
"""
import ast
import re
import xml.etree.ElementTree as ElementTree
from collections import Counter
from pathlib import Path
from typing import Dict, List, NamedTuple, Optional, Set, Tuple

from tb3_labs.marking.names import NAME, is_name

MANIFEST = 'package.xml'
#: At most this much of a package.xml is read [bytes].
LARGEST_MANIFEST = 1000000
#: The folders of a package's messages, services and actions; also the endings of their files.
INTERFACES = MESSAGES, SERVICES, ACTIONS = 'msg', 'srv', 'action'
#: A field of a type of another package, as in `geometry_msgs/Pose2D goal`.
FIELD = re.compile(r'^[ \t]*([A-Za-z]\w*)/[A-Za-z]\w*(?:\[\d*\])?\s+\w', re.MULTILINE)
#: If a program catches one of these errors around an import, it runs without the module.
CAUGHT = {'ImportError', 'ModuleNotFoundError', 'Exception', 'BaseException'}


def files_in(folder: Path) -> List[Path]:
    """Returns the paths of all files below `folder`, in order, without links."""
    return sorted(path for path in folder.rglob('*') if path.is_file() and not path.is_symlink())


def package_folder(path: Path, folder: Path) -> Optional[Path]:
    """Returns the nearest folder above `path`, within `folder`, with a package.xml; else None."""
    for parent in path.parents:
        if (parent / MANIFEST).is_file():
            return parent
        if parent == folder:
            return None
    return None


def name_in(manifest: Path) -> Tuple[str, str]:
    """Returns (name in a package.xml, ''), or ('', reason) if there is no valid name."""
    if not manifest.is_file():
        return '', 'The package has no package.xml: one was made.'
    try:
        text = manifest.read_bytes()[:LARGEST_MANIFEST].decode('utf-8-sig', errors='replace')
        if '<!ENTITY' in text:      # an entity may expand to millions of others
            raise ValueError('it has entities')
        name = (ElementTree.fromstring(text).findtext('name') or '').strip()
    except (ElementTree.ParseError, ValueError, LookupError, RecursionError) as error:
        return '', 'package.xml cannot be read ({}): one was made.'.format(error)
    if NAME.fullmatch(name.replace('-', '_')):
        return name, ''
    return '', 'The package is called {!r}: it got another name.'.format(name[:60])


def packages_in(folder: Path, node: Path) -> Dict[str, Path]:
    """Returns name -> folder of all packages below `folder` whose names a program can import.

    A package has a package.xml, or at least message files. If several packages have one name, the
    package nearest to `node` is taken.
    """
    found: Dict[str, Set[Path]] = {}
    for path in files_in(folder):
        if path.name == MANIFEST:
            name, place = name_in(path)[0] or path.parent.name, path.parent
        elif path.parent.name in INTERFACES and path.suffix == '.' + path.parent.name:
            place = path.parent.parent
            if (place / MANIFEST).exists():
                continue
            name = place.name
        else:
            continue
        if is_name(name):
            found.setdefault(name, set()).add(place)

    def far(place: Path) -> Tuple[int, int, str]:
        common = set(place.parents) & set(node.parents)
        return -len(common), len(place.parts), str(place)
    return {name: min(places, key=far) for name, places in found.items()}


def interface_files(package: Path) -> Dict[str, List[str]]:
    """Returns kind -> names of the files of this kind, in a package; the names may be invalid."""
    return {kind: sorted(path.name for path in (package / kind).glob('*.' + kind) if path.is_file())
            for kind in INTERFACES}


def types_used(package: Path) -> Set[str]:
    """Returns the packages whose types are fields of the messages in a package's folder."""
    texts = [(package / kind / name).read_text(encoding='utf-8', errors='replace')
             for kind, names in interface_files(package).items() for name in names]
    return set(FIELD.findall('\n'.join(texts)))


# -- imports

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


def _lines_of(node):
    return range(node.lineno, (node.end_lineno or node.lineno) + 1)


def imports_of(text: str) -> List[Import]:
    """Returns the import statements of a program, in order; [] if it is not valid Python.

    Imports of the program's own package (``from . import x``) are left out.
    """
    nodes = _nodes_of(text)
    used = {node.id for node in nodes if isinstance(node, ast.Name)}
    guarded = {id(inner) for node in nodes if isinstance(node, ast.Try)
               and any(_catches(handler) for handler in node.handlers)
               for statement in node.body for inner in ast.walk(statement)}
    on_line = Counter(line for node in nodes if isinstance(node, ast.stmt)
                      and not hasattr(node, 'body') for line in _lines_of(node))
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
        lines = _lines_of(node)
        # an import beside another statement in one line cannot be taken out alone
        alone = all(on_line[line] == 1 for line in lines)
        found.append(Import(modules, lines[0], lines[-1], not alone or '*' in bound or bool(bound & used),
                            id(node) in guarded))
    return sorted(found, key=lambda item: item.first)


def _catches(handler):
    return handler.type is None or any(
        isinstance(node, ast.Name) and node.id in CAUGHT for node in ast.walk(handler.type))


# -- what a node needs

def needed_by(node: Path, packages: Dict[str, Path]) -> List[str]:
    """The packages that must be built for a node; each one follows the packages it needs.

    `packages`: name -> folder of all packages. Imports of modules beside the node count too.
    """
    order: List[str] = []
    seen: Set[str] = set()

    def visit(name: str) -> None:
        if name in seen or name not in packages:
            return
        seen.add(name)
        place = packages[name]
        for other in sorted(types_used(place)):
            visit(other)
        for path in sorted(place.glob('src/{}/**/*.py'.format(name))):
            for imported in sorted(_imported_by(path)):
                visit(imported)
        order.append(name)

    programs = [node]
    for program in programs:        # modules beside the node are added as they are found
        for imported in sorted(_imported_by(program)):
            visit(imported)
            beside = node.parent / (imported + '.py')
            if beside.is_file() and beside not in programs:
                programs.append(beside)
    return order


def _imported_by(path):
    text = path.read_bytes().decode('utf-8-sig', errors='replace')    # Windows' first bytes
    return {name for item in imports_of(text) for name in item.packages}
