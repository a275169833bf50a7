"""The packages of a submission: their names, their messages, and those that a node imports.

All files are read as texts; nothing is imported or run.
"""
import ast
import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Dict, List, NamedTuple, Optional, Set, Tuple

from tb3_labs.marking.names import NAME, is_name

MANIFEST = 'package.xml'
#: This much of a package.xml is read [bytes].
LARGEST_MANIFEST = 1000000
#: The folders of a package's messages, services and actions; the names of their files end alike.
INTERFACES = ('msg', 'srv', 'action')
#: A field of a type of another package, as in `geometry_msgs/Pose2D goal`.
FIELD = re.compile(r'^\s*([A-Za-z]\w*)/[A-Za-z]\w*(?:\[\d*\])?\s+\w', re.MULTILINE)
#: A program that catches one of these around an import goes on without the module.
CAUGHT = {'ImportError', 'ModuleNotFoundError', 'Exception', 'BaseException'}


# -- files and manifests

def files_in(folder: Path) -> List[Path]:
    """The paths of all files below `folder`, in order; no links."""
    return sorted(path for path in folder.rglob('*') if path.is_file() and not path.is_symlink())


def package_folder(path: Path, folder: Path) -> Optional[Path]:
    """The nearest folder above `path` that has a package.xml, within `folder`; None if none has."""
    for parent in path.parents:
        if (parent / MANIFEST).is_file():
            return parent
        if parent == folder:
            return None
    return None


def name_in(manifest: Path) -> Tuple[str, str]:
    """The name in a package.xml and '', or '' and the reason why there is none."""
    if not manifest.is_file():
        return '', 'The package has no package.xml: one was made.'
    try:
        text = manifest.read_bytes()[:LARGEST_MANIFEST].decode('utf-8-sig', errors='replace')
        if '<!ENTITY' in text:      # it may stand for millions of others
            raise ValueError('it has entities')
        name = (ElementTree.fromstring(text).findtext('name') or '').strip()
    except (ElementTree.ParseError, ValueError, LookupError, RecursionError) as error:
        return '', 'package.xml cannot be read ({}): one was made.'.format(error)
    if NAME.fullmatch(name.replace('-', '_')):
        return name, ''
    return '', 'The package is called {!r}: it got another name.'.format(name[:60])


def packages_in(folder: Path, node: Path) -> Dict[str, Path]:
    """name -> folder, of all packages below `folder`: those with a package.xml, and folders that
    hold message files without one. Of several with one name that nearest to `node` is taken. A name
    that a program cannot import is left out."""
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
        common = sum(1 for parent in place.parents if parent in node.parents)
        return -common, len(place.parts), str(place)
    return {name: min(places, key=far) for name, places in found.items()}


# -- messages

def interface_files(package: Path) -> Dict[str, List[str]]:
    """kind ('msg', 'srv', 'action') -> names of the files of a package's folder; only kinds that
    there are. Their names may be anything."""
    return {kind: sorted(path.name for path in (package / kind).glob('*.' + kind) if path.is_file())
            for kind in INTERFACES if any((package / kind).glob('*.' + kind))}


def _types_used(package):
    texts = [(package / kind / name).read_text(encoding='utf-8', errors='replace')
             for kind, names in interface_files(package).items() for name in names]
    return set(FIELD.findall('\n'.join(texts)))


# -- imports

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
    simple = [node for node in ast.walk(tree)
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
        alone = sum(other.lineno <= last and first <= (other.end_lineno or other.lineno)
                    for other in simple) == 1
        found.append(Import(modules, first, last, not alone or '*' in bound or bool(bound & used),
                            id(node) in guarded))
    return sorted(found, key=lambda item: item.first)


def _catches(handler):
    return handler.type is None or any(
        isinstance(node, ast.Name) and node.id in CAUGHT for node in ast.walk(handler.type))


def without(text: str, imports: List[Import]) -> str:
    """The program without these imports; each line of them becomes a comment, so that the numbers
    of the other lines stay."""
    lines = text.splitlines(True)
    for item in imports:
        begin = item.first - 1
        indent = lines[begin][:-len(lines[begin].lstrip())]
        for number in range(begin, item.last):
            lines[number] = '{}{}# {}'.format(
                indent, 'pass    ' * (number == begin), lines[number].lstrip())
    return ''.join(lines)


def needed_by(node: Path, packages: Dict[str, Path]) -> List[str]:
    """Names of the packages that a node needs built, each after those that it needs itself.

    `packages`: name -> folder of all that there are. The modules beside the node count as well.
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
    """The modules that a program imports, up to their first dot."""
    text = path.read_bytes().decode('utf-8-sig', errors='replace')    # Windows' first bytes
    return {name for item in imports_of(text) for name in item.packages}
