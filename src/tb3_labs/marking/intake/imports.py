"""Follows the imports of a node, also through the submission's own modules. Finds the packages that
the imports need, and the modules that are missing.

The files of the submission are only read. A module of the marking machine is imported, to see if it
works without a screen.
"""
import ast
import json
import os
import pkgutil
import re
import subprocess
import sys
from contextlib import suppress
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Dict, List, NamedTuple, Tuple

from tb3_labs.marking.intake.archives import files_in
from tb3_labs.marking.intake.packages import (
    MESSAGES, SERVICES, distance, interface_files, modules_of, own_name)
from tb3_labs.marking.names import is_name, is_typo_of
from tb3_labs.marking.source_analysis import nodes_of

#: A program that catches one of these errors around an import runs without the module.
IMPORT_ERRORS = {'ImportError', 'ModuleNotFoundError', 'Exception', 'BaseException'}
#: Methods that a module calls to change Python's path.
CHANGES_PATH = 'append', 'insert', 'load_manifest', 'join', 'dirname', 'abspath', 'realpath'
#: A field of a type of another package, as in `geometry_msgs/Pose2D goal`.
FIELD = re.compile(r'^[ \t]*([A-Za-z]\w*)/[A-Za-z]\w*(?:\[\d*\])?\s+\w', re.MULTILINE)
#: The types that the course gives to the students. tb3_labs has a file of each type.
COURSE_TYPES = {MESSAGES: ('MouseController',), SERVICES: ('SetInitialPose', 'ResetPose')}
#: A larger file is not a program [bytes].
LARGEST_PROGRAM = 1000000
#: This program prints {module: error} of the modules that cannot be imported. Its memory is not
#: limited, since a large module needs more memory than the reading of a submission.
TRY_IMPORTS = '''import importlib, json, resource, sys
resource.setrlimit(resource.RLIMIT_AS, resource.getrlimit(resource.RLIMIT_AS)[1:] * 2)
errors = {}
for name in sys.argv[1:]:
    try:
        importlib.import_module(name)
    except Exception as error:
        errors[name] = (str(error).strip() or type(error).__name__).splitlines()[0]
print()
print(json.dumps(errors))
'''
#: The program TRY_IMPORTS is stopped after this time [s].
IMPORT_TIME = 20.0


class Import(NamedTuple):
    """The import of a module by a program."""

    importer: Path              # the program's file
    module: str                 # with dots, as it is written
    names: Tuple[str, ...]      # the names imported from it; () if the module itself is imported
    used: bool                  # is an imported name used?
    guarded: bool               # does the program go on if the import fails?
    level: int = 0              # the number of dots in front, as in `from ..laws import name`
    files: Tuple[Path, ...] = ()    # the submission's files that this import reads

    @property
    def package(self) -> str:
        """The module up to its first dot."""
        return self.module.split('.')[0]


def _imports_of(program, text):
    """Returns the Imports in the text of a program; [] if the text is not valid Python."""
    nodes = nodes_of(text)
    used = {node.id for node in nodes if isinstance(node, ast.Name)}
    guarded = {id(inner) for node in nodes if isinstance(node, ast.Try)
               and any(_catches(handler) for handler in node.handlers)
               for statement in node.body for inner in ast.walk(statement)}
    found = []
    for node in nodes:
        if isinstance(node, ast.Import):
            found += [Import(program, alias.name, (),
                             (alias.asname or alias.name.split('.')[0]) in used,
                             id(node) in guarded) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            bound = {alias.asname or alias.name for alias in node.names}
            found.append(Import(
                program, node.module or '', tuple(alias.name for alias in node.names),
                bool(bound & {'*', *used}), id(node) in guarded, node.level))
    return list(dict.fromkeys(found))


def _catches(handler):
    return handler.type is None or any(
        isinstance(node, ast.Name) and node.id in IMPORT_ERRORS for node in ast.walk(handler.type))


def starts(text: str) -> bool:
    """Does a program do more than define names? A text that is not valid Python may."""
    nodes = nodes_of(text)
    if not nodes:
        return True
    actions = [each for each in nodes[0].body if isinstance(
        each, (ast.Expr, ast.If, ast.For, ast.While, ast.With, ast.Try))]
    calls = [inner for each in actions for inner in ast.walk(each) if isinstance(inner, ast.Call)]
    return any(getattr(call.func, 'attr', '') not in CHANGES_PATH for call in calls)


class OwnModules:
    """The node and the submission's modules that the node imports, directly or through others."""

    def __init__(self, node: Path, folder: Path, packages: Dict[str, Path]) -> None:
        self._node = node
        self._files = {path for path in files_in(folder) if path.suffix == '.py'}
        self._folders = {parent for path in self._files for parent in path.parents}
        #: For each module that a setup.py installs: its package, and the folder above the module.
        self.package_of: Dict[str, str] = {}
        self._installed: Dict[str, Path] = {}
        for name, package in packages.items():
            for place in modules_of(package, name):
                self.package_of[place.name], self._installed[place.name] = name, place.parent
        self._anywhere: Dict[str, Path] = {}
        for path in sorted(
                self._files, key=lambda each: distance(each, node, folder), reverse=True):
            self._anywhere[path.parent.name] = path.parent.parent
            self._anywhere[path.stem] = path.parent
        #: file of the node or of a module -> its text
        self.texts: Dict[Path, str] = {}
        self.imports: List[Import] = []
        files = [node]
        for file in files:      # the list grows meanwhile
            if file not in self.texts and file.stat().st_size <= LARGEST_PROGRAM:
                data = file.read_bytes()
                self.texts[file] = data.decode(errors='replace')
                for item in _imports_of(file, data):
                    self.imports.append(item._replace(files=self._files_of(item)))
                    files += self.imports[-1].files

    def is_on_path(self, module: str) -> bool:
        """Does Python look for modules in this module's folder?"""
        beside = self._node.parent
        return (module in self._installed or beside / f'{module}.py' in self._files
                or beside / module in self._folders)

    def _files_of(self, item):
        """Returns the files of the submission that an Import reads. Modules in other
        folders than Python's path are found too, since the program may change this path."""
        folder = self._installed.get(item.package, self._node.parent)
        if item.level:
            folder = Path(*item.importer.parts[:-item.level])
        elif not self.is_on_path(item.package):
            if _is_installed(item.package) or item.package not in self._anywhere:
                return ()
            folder = self._anywhere[item.package]
        found = []
        for part in item.module.split('.')[:99] if item.module else []:
            found.append(folder / f'{part}.py')
            folder /= part
            found.append(folder / '__init__.py')
        for name in item.names:
            found += [folder / f'{name}.py', folder / name / '__init__.py']
        return tuple(path for path in found if path in self._files)


def _is_installed(module, *folders):
    """Does Python find a module in these folders, or in the marking machine's own folders?"""
    return (module in sys.builtin_module_names
            or PathFinder.find_spec(module, [*folders, *sys.path]) is not None)


class Needs(NamedTuple):
    """The needs of a node besides the system's modules."""

    packages: List[str]         # packages of the submission
    substituted: Dict[str, List[str]]   # missing package -> files of the COURSE_TYPES that it needs
    unused: List[str]           # missing modules that it imports but never uses
    missing: Dict[str, str]     # missing package that it uses -> module, such as a.b
    broken: Dict[str, str]      # module that it uses, and that does not work here -> the error
    misspelt: Dict[str, str]    # missing module -> the module that was probably meant
    elsewhere: List[Path]       # own modules in folders where Python does not look


def find_needs(node: Path, folder: Path, packages: Dict[str, Path]) -> Needs:
    """Returns the Needs of a node. `packages` has name -> folder of the submission's packages.
    Other names by which programs import messages are added to `packages`."""
    own = OwnModules(node, folder, packages)
    imports = [item for item in own.imports if not item.level]
    for item in imports:
        _add_second_name(item, packages)
    available = {name for name, place in packages.items() if any(
        interface_files(place).values()) or (place / 'setup.py').exists()}
    found = {item.package: item.files[-1] for item in imports if item.files}
    others = [item for item in imports
              if not item.guarded and item.package not in available.union(found)]
    broken = _broken(sorted({item.package for item in others}))
    failing = [item for item in others if item.package in broken
               or not _is_installed(item.package, str(node.parent))]
    substituted: Dict[str, List[str]] = {}
    for item in failing:
        if item.package not in packages:
            files = _course_files(item, own.texts[item.importer])
            if files:
                substituted[item.package] = sorted({*files, *substituted.get(item.package, [])})
    misspelt = _misspelt({item.package for item in failing} - {*substituted, *broken})
    # a module may import a name for the modules that import it
    passed_on = {name for item in imports if item.files for name in item.names}
    left = [item for item in failing if item.package not in {*substituted, *misspelt}]
    used = {item.package: item.module for item in left
            if item.used or passed_on.intersection(item.names)}
    changes_path = any('sys.path' in text for text in own.texts.values())
    return Needs(
        _needed_packages(own, packages), substituted,
        sorted({item.module for item in left if item.package not in used}),
        {name: module for name, module in used.items() if name not in broken},
        {name: why for name, why in broken.items() if name in used}, misspelt,
        [] if changes_path else sorted(
            file for name, file in found.items()
            if name not in available and not own.is_on_path(name)))


def _add_second_name(item, packages):
    """If a program imports messages by an unknown package name, and only one package has messages
    with these names, give this package the unknown name as a second name."""
    kind, *_ = item.module.split('.')[1:2] or ['']
    if kind in COURSE_TYPES and item.package not in packages and not _is_installed(item.package):
        imports_all = not item.names or '*' in item.names
        having = set()
        for package in packages.values():
            types = {file.partition('.')[0] for file in interface_files(package)[kind]}
            if types & set(item.names) or types and imports_all and not own_name(package):
                having.add(package)
        if len(having) == 1:
            packages[item.package] = having.pop()


def _course_files(item, text):
    """Returns the files of the COURSE_TYPES that an import of a missing package needs."""
    if not is_name(item.package):
        return []
    kinds = item.module.split('.')[1:2] or item.names
    # not after `import lab1.msg`, `from lab1 import msg` or `from lab1.msg import *`
    names_its_types = item.names and '*' not in item.names and set(kinds) != {*item.names}
    listed = ' '.join(item.names) + item.module if names_its_types else text
    return [f'{kind}/{name}.{kind}' for kind in kinds for name in COURSE_TYPES.get(kind, ())
            if name in listed]


def _needed_packages(own, packages):
    """Returns the names of the packages whose types or modules are imported, or whose names are in
    quotes, as for rospkg. Adds the packages whose types are fields of their messages."""
    names = sorted({item.package for item in own.imports}.union(
        re.findall(r'[\'"](\w+)[\'"]', '\n'.join(own.texts.values()))))
    needed = []
    for name in names:          # the list grows meanwhile
        package = name if name in packages else own.package_of.get(name)
        if package and package not in needed:
            needed.append(package)
            names += sorted(_packages_of_types(packages[package]))
    return needed


def _packages_of_types(package):
    """Returns the packages whose types are fields of the messages in a package's folder."""
    texts = [(package / kind / name).read_text(encoding='utf-8', errors='replace')
             for kind, names in interface_files(package).items() for name in names]
    return set(FIELD.findall('\n'.join(texts)))


def _misspelt(missing):
    """Returns missing name -> the module that was meant, for names with a typing error."""
    known = {each.name for each in pkgutil.iter_modules(sys.path)}.union(sys.builtin_module_names)
    return {name: near for name in missing for near in sorted(known)
            if len(near) > 3 and is_typo_of(name, near)}


def _broken(modules):
    """Returns {module: error} of the installed modules that cannot be imported without a screen."""
    installed = []
    for name in modules:
        spec = PathFinder.find_spec(name, sys.path)
        if spec and re.search('(site|dist)-packages', spec.origin or '') and not (
                Path(spec.origin).parent / MESSAGES).is_dir():
            installed.append(name)
    if not installed:
        return {}
    environment = {name: value for name, value in os.environ.items() if name != 'DISPLAY'}
    with suppress(subprocess.SubprocessError, ValueError, IndexError):
        printed = subprocess.run(
            [sys.executable, '-c', TRY_IMPORTS, *installed], stdout=subprocess.PIPE, cwd='/',
            stderr=subprocess.DEVNULL, timeout=IMPORT_TIME, env=environment,
            universal_newlines=True).stdout
        return json.loads(printed.splitlines()[-1])
    return {}
