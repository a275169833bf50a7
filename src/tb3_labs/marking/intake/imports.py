"""Finds the missing modules that a node imports itself, or by another module of its submission.

The programs of the submission are only read. A module of the marking machine is imported, to see if
it works without a screen. A module of the submission is not imported here. Python imports it in the
trial, and then says what is missing.
"""
import ast
import json
import os
import subprocess
import sys
from contextlib import suppress
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Dict, List, NamedTuple, Set, Tuple

from tb3_labs.marking.intake.archives import files_in
from tb3_labs.marking.intake.packages import MESSAGES, SERVICES, interface_files, own_name
from tb3_labs.marking.names import is_name
from tb3_labs.marking.source_analysis import nodes_of

#: If a statement of these kinds has a call, the program does something.
ACTING_STATEMENTS = ast.Expr, ast.If, ast.For, ast.While, ast.With, ast.Try
#: Methods that a module calls to change Python's path.
CHANGES_PATH = 'append', 'insert', 'load_manifest', 'join', 'dirname', 'abspath', 'realpath'
#: The types that the course gives to the students. tb3_labs has a file of each type.
COURSE_TYPES = {MESSAGES: ('MouseController',), SERVICES: ('SetInitialPose', 'ResetPose')}
#: A larger file is not a program [bytes].
MAX_PROGRAM_BYTES = 1000000
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

    module: str                 # with dots, as it is written; '' in `from . import name`
    names: Tuple[str, ...]      # the names imported from it; () if the module itself is imported
    bound: Tuple[str, ...]      # the names that the program gives to `names`, or to the module
    is_relative: bool           # does it begin with a dot, as in `from .laws import name`?
    may_fail: bool              # is it in a `try`?

    @property
    def package(self) -> str:
        """The module up to its first dot."""
        return self.module.split('.')[0]

    @property
    def kinds(self) -> List[str]:
        """The kinds of generated types that it imports: 'msg', 'srv', both or none."""
        words = [*self.module.split('.')[1:], *self.names]
        return [kind for kind in COURSE_TYPES if kind in words]


class Program(NamedTuple):
    """A program of the submission. A text that is not valid Python has no imports."""

    text: str
    imports: List[Import]
    used: Set[str]              # its names of variables, functions and modules


class MissingModules(NamedTuple):
    """The modules that a node imports, and that do not work here."""

    substituted: Dict[str, List[str]]   # package -> files of the COURSE_TYPES that it needs
    unused: List[str]           # modules that it never uses
    used: Dict[str, str]        # module that it uses -> the error of its import


def _read_program(path):
    data = path.read_bytes()
    nodes = nodes_of(data)
    tried = {id(inner) for node in nodes if isinstance(node, ast.Try)
             for statement in node.body for inner in ast.walk(statement)}
    imports = []
    for node in nodes:
        may_fail = id(node) in tried
        if isinstance(node, ast.Import):
            for alias in node.names:
                bound = alias.asname or alias.name.split('.')[0]
                imports.append(Import(alias.name, (), (bound,), False, may_fail))
        elif isinstance(node, ast.ImportFrom):
            names = tuple(alias.name for alias in node.names)
            bound = tuple(alias.asname or alias.name for alias in node.names)
            imports.append(Import(node.module or '', names, bound, node.level > 0, may_fail))
    return Program(data.decode(errors='replace'), list(dict.fromkeys(imports)),
                   {node.id for node in nodes if isinstance(node, ast.Name)})


def programs_of(node: Path, package: Path) -> Dict[Path, Program]:
    """Returns file -> Program, for the node and its modules in the folder `package`. A file is one
    of these modules if its name is in an import of the node, or in an import of such a module."""
    modules: Dict[str, List[Path]] = {}
    for path in files_in(package):
        if path.suffix == '.py' and path.stat().st_size <= MAX_PROGRAM_BYTES:
            name = path.parent.name if path.stem == '__init__' else path.stem
            modules.setdefault(name, []).append(path)
    programs: Dict[Path, Program] = {}
    files = [node]
    for file in files:      # the list grows meanwhile
        if file not in programs:
            programs[file] = _read_program(file)
            for item in programs[file].imports:
                for name in (*item.module.split('.'), *item.names):
                    files += modules.get(name, [])
    return programs


def is_main_program(text: str) -> bool:
    """Does a program do more than define names? Returns True if a text is not valid Python."""
    nodes = nodes_of(text)
    if not nodes:
        return True
    actions = [statement for statement in nodes[0].body if isinstance(statement, ACTING_STATEMENTS)]
    calls = [part for action in actions for part in ast.walk(action) if isinstance(part, ast.Call)]
    return any(getattr(call.func, 'attr', '') not in CHANGES_PATH for call in calls)


def find_missing(node: Path, package: Path, folder: Path, packages: Dict[str, Path]
                 ) -> MissingModules:
    """Returns the MissingModules of a node. `package` is the folder of the node's package. `folder`
    is the folder of the submission. `packages` has name -> folder of the submission's packages.
    Other names by which programs import messages are added to `packages`."""
    programs = programs_of(node, package).values()
    used_names = {'*'}.union(*(program.used for program in programs))
    own_modules = {name for path in files_in(folder) if path.suffix == '.py'
                   for name in (path.stem, path.parent.name)}
    # each import with the text of its program
    imports = [(item, program.text) for program in programs for item in program.imports
               if not (item.is_relative or item.may_fail)
               and not _is_handed_in(item, own_modules, packages)]
    errors = _import_errors(sorted({item.package for item, _ in imports}))
    substituted: Dict[str, List[str]] = {}
    failing = []
    for item, text in imports:
        if item.package in errors:
            _add_second_name(item, packages)
            files = [] if item.package in packages else _course_files(item, text)
            if files:
                substituted[item.package] = sorted({*files, *substituted.get(item.package, [])})
            failing.append(item)
    left = [item for item in failing if item.package not in substituted
            and not _is_handed_in(item, own_modules, packages)]
    used = {item.package: item.module for item in left if used_names.intersection(item.bound)}
    return MissingModules(
        substituted, sorted({item.module for item in left if item.package not in used}),
        {module: errors[name] for name, module in used.items()})


def _is_handed_in(item, own_modules, packages):
    """Does the submission itself contain the types, or the module, that a program imports?"""
    if item.package in packages and any(interface_files(packages[item.package]).values()):
        return True
    return item.package in own_modules and not item.kinds


def _add_second_name(item, packages):
    """If a program imports messages by an unknown package name, and only one package has messages
    with these names, give this package the unknown name as a second name."""
    if item.package in packages:
        return
    imports_all = not item.names or bool(set(item.names) & {'*', *item.kinds})
    possible = set()
    for package in packages.values():
        files = [file for kind in item.kinds for file in interface_files(package)[kind]]
        types = {file.partition('.')[0] for file in files}
        has_imported_type = bool(types & set(item.names))
        may_have_all = imports_all and bool(types) and not own_name(package)
        if has_imported_type or may_have_all:
            possible.add(package)
    if len(possible) == 1:
        packages[item.package] = possible.pop()


def _course_files(item, text):
    """Returns the files of the COURSE_TYPES that the import of a missing package needs. If the
    import does not name its types, the names in the `text` of the program are used."""
    if not is_name(item.package):
        return []
    names_types = bool(item.names) and not set(item.names) & {'*', *item.kinds}
    words = ' '.join(item.names) if names_types else text
    return [f'{kind}/{name}.{kind}' for kind in item.kinds for name in COURSE_TYPES[kind]
            if name in words]


def _import_errors(modules):
    """Returns {module: error} of the modules that cannot be imported without a screen. Python's own
    modules are not tried, since they can be imported."""
    errors = {}
    installed = []
    for name in modules:
        spec = PathFinder.find_spec(name)
        if spec is None and name not in sys.builtin_module_names:
            errors[name] = f"No module named '{name}'"
        elif spec is not None and '-packages' in str(spec.origin):
            installed.append(name)
    environment = {name: value for name, value in os.environ.items() if name != 'DISPLAY'}
    with suppress(OSError, subprocess.SubprocessError, ValueError, IndexError):
        printed = subprocess.run(
            [sys.executable, '-c', TRY_IMPORTS, *installed], stdout=subprocess.PIPE, cwd='/',
            stderr=subprocess.DEVNULL, timeout=IMPORT_TIME, env=environment,
            universal_newlines=True).stdout
        errors.update(json.loads(printed.splitlines()[-1]))
    return errors
