"""Finds the missing modules that a node, or another module of its submission, imports.

If this search overlooks a missing module, Python reports the module in the trial.
"""
import ast
import shutil
import sys
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Dict, List, NamedTuple, Set, Tuple

import rospkg

from tb3_labs.marking.intake.archives import files_in
from tb3_labs.marking.intake.packages import (
    DEFINITION_KINDS, MAX_MANIFEST_BYTES, definition_files, definition_files_below, distance_key,
    is_old_or_copy)
from tb3_labs.marking.student_nodes import OWN_PACKAGE, is_valid_name, syntax_nodes_of

#: A module runs code on import if one of these statements has a call.
EXECUTED_STATEMENTS = ast.Expr, ast.If, ast.For, ast.While, ast.With, ast.Try
#: Methods that a module calls to change Python's path.
PATH_METHODS = 'append', 'insert', 'load_manifest', 'join', 'dirname', 'abspath', 'realpath'
MAX_PROGRAM_BYTES = 10 ** 6         # a larger file is not read
#: These modules may be installed, but they cannot be imported without a screen.
SCREEN_MODULES = 'pynput', 'pyautogui'
PLACEHOLDERS = 'placeholders'       # the folder of the packages that the marking makes


class Import(NamedTuple):
    """The import of a module by a program."""

    module: str                       # the module's name with all dots, such as '.laws'
    names: Tuple[str, ...]            # the imported names, or () for `import module`
    defined_names: Tuple[str, ...]    # the names by which the program uses the import
    may_fail: bool                    # the import is in a `try`

    @property
    def package(self) -> str:
        """The module's name up to the first dot, or '' for `from .laws import name`."""
        return self.module.split('.')[0]

    @property
    def imports_types(self) -> bool:
        """True if the program imports messages or services."""
        return bool({*self.module.split('.')[1:], *self.names} & set(DEFINITION_KINDS))


class ParsedProgram(NamedTuple):
    """A program of the submission."""

    text: str
    imports: List[Import]
    used_names: Set[str]        # the variables, functions and modules that the program uses
    runs_code_on_import: bool   # the program does more than define names, or is invalid


class MissingModules(NamedTuple):
    """The modules that a node imports and the marking machine lacks."""

    placeholders: List[str]     # packages of messages and services that were not handed in
    unused_modules: List[str]   # modules that no program uses
    used_modules: List[str]     # modules that a program uses


def read_program(path: Path) -> ParsedProgram:
    """Returns the ParsedProgram in a file."""
    data = path.read_bytes()
    text = data.decode(errors='replace')
    syntax_nodes = syntax_nodes_of(data)
    if not syntax_nodes:
        return ParsedProgram(text, [], set(), runs_code_on_import=True)
    used_names = {syntax.id for syntax in syntax_nodes if isinstance(syntax, ast.Name)}
    return ParsedProgram(text, _imports_in(syntax_nodes), used_names,
                         runs_code_on_import=_runs_code(syntax_nodes[0]))


def _imports_in(syntax_nodes):
    statements_in_try = [statement for syntax in syntax_nodes if isinstance(syntax, ast.Try)
                         for statement in syntax.body]
    syntax_in_try = {syntax for statement in statements_in_try for syntax in ast.walk(statement)}
    imports = []
    for syntax in syntax_nodes:
        may_fail = syntax in syntax_in_try
        if isinstance(syntax, ast.Import):
            for alias in syntax.names:
                defined_name = alias.asname or alias.name.split('.')[0]
                imports.append(Import(alias.name, (), (defined_name,), may_fail))
        elif isinstance(syntax, ast.ImportFrom):
            module = '.' * syntax.level + (syntax.module or '')
            names = tuple(alias.name for alias in syntax.names)
            defined_names = tuple(alias.asname or alias.name for alias in syntax.names)
            imports.append(Import(module, names, defined_names, may_fail))
    return list(dict.fromkeys(imports))


def _runs_code(module_syntax):
    """Returns True if a module does more than define names and change Python's path."""
    for statement in module_syntax.body:
        if isinstance(statement, EXECUTED_STATEMENTS):
            calls = [syntax for syntax in ast.walk(statement) if isinstance(syntax, ast.Call)]
            called_methods = {getattr(call.func, 'attr', '') for call in calls}  # '' for functions
            if called_methods - set(PATH_METHODS):
                return True
    return False


def programs_of(node: Path, package: Path) -> Dict[Path, ParsedProgram]:
    """Returns {file: ParsedProgram} of the node and of all modules in the folder `package` that the
    node imports, directly or through other modules."""
    module_files: Dict[str, List[Path]] = {}
    for path in files_in(package):
        if path.suffix == '.py' and path.stat().st_size <= MAX_PROGRAM_BYTES:
            module = path.parent.name if path.stem == '__init__' else path.stem
            module_files.setdefault(module, []).append(path)
    programs: Dict[Path, ParsedProgram] = {}
    files = [node]
    for file in files:      # the loop adds files to this list
        if file in programs:
            continue
        programs[file] = read_program(file)
        for imported in programs[file].imports:
            for name in (*imported.module.split('.'), *imported.names):
                files += module_files.get(name, [])
    return programs


def find_missing_modules(node: Path, package: Path, folder: Path,
                         packages: Dict[str, Path]) -> MissingModules:
    """Make the missing packages of messages. Returns the MissingModules of a node.

    `package` is the folder of the node's package. `folder` is the folder of the submission.
    `packages` is {name: folder} of the submission's packages. If the node imports messages from a
    package that `packages` lacks, the package is made in `folder` and added to `packages`. The new
    package gets copies of all types of tb3_labs and of the submission. An imported package that was
    handed in without messages gets the same copies.
    """
    programs = programs_of(node, package).values()
    files = [path for path in files_in(folder) if path.suffix == '.py']
    own_modules = {path.stem for path in files} | {path.parent.name for path in files}
    type_files = _type_files(node, folder)
    # a service also has a type for its request and a type for its response
    types = {path.stem + end for path in type_files for end in ('', 'Request', 'Response')}
    placeholders: Set[str] = set()
    missing_imports: List[Import] = []
    for program in programs:
        for imported in program.imports:
            if imported.may_fail or _is_available(imported, own_modules, packages):
                continue
            if _can_be_placeholder(imported, program, types):
                placeholders.add(imported.package)
            else:
                missing_imports.append(imported)
    for name in sorted(placeholders):
        placeholder = packages.setdefault(name, folder / PLACEHOLDERS / name)
        _copy_types(type_files, placeholder)

    missing = [imported for imported in missing_imports if imported.package not in placeholders]
    # '*' counts as used, because `from module import *` may define any name
    used_names = {'*'}.union(*(program.used_names for program in programs))
    used = [imported for imported in missing if used_names.intersection(imported.defined_names)]
    used_packages = {imported.package for imported in used}
    unused_modules = {imported.module for imported in missing
                      if imported.package not in used_packages}
    used_modules = {imported.module for imported in used}
    return MissingModules(sorted(placeholders), sorted(unused_modules), sorted(used_modules))


def _is_available(imported, own_modules, packages):
    name = imported.package
    if not name:        # the module's name begins with a dot
        return True
    if name in packages and definition_files(packages[name]):
        return True
    if name in own_modules and not imported.imports_types:
        return True
    if name in SCREEN_MODULES:
        return False
    return name in sys.builtin_module_names or PathFinder.find_spec(name) is not None


def _can_be_placeholder(imported, program, types):
    """Returns True if a program imports only `types` from a package. If the import names no type,
    the program's text must contain one of `types`."""
    if not (imported.imports_types and is_valid_name(imported.package)):
        return False
    names = set(imported.names) - {*DEFINITION_KINDS, '*'}
    if names:
        return names <= types
    return any(name in program.text for name in types)


def _type_files(node, folder):
    """Returns the message and service files of tb3_labs, then those of the submission. The file
    nearest to the node is last."""
    own_files = definition_files(Path(rospkg.RosPack().get_path(OWN_PACKAGE)))
    submission_files = [path for path in definition_files_below(folder)
                        if is_valid_name(path.stem) and path.stat().st_size <= MAX_MANIFEST_BYTES
                        and not is_old_or_copy(str(path.relative_to(folder)))]
    submission_files.sort(key=lambda path: distance_key(path, node, folder), reverse=True)
    return own_files + submission_files


def _copy_types(type_files, package):
    """Copy files into a package. If several files have the same name, the last is kept."""
    for path in type_files:
        folder = package / path.suffix.lstrip('.')
        folder.mkdir(parents=True, exist_ok=True)
        shutil.copy(str(path), str(folder))
