"""A workspace with a copy of a student's package that can run.

Some faults come from Windows or from the way of a file to the marking machine: no exec bit, line
endings, a byte order mark. They are repaired in the copy. A name that a command line or a package
cannot have is replaced; an unused import of a module that this machine lacks is left out. A remark
tells each of these.

A Python node needs nothing else of a build: messages, services, and the modules of a setup.py.
catkin is not run. A CMakeLists.txt often needs packages that the marking machine does not have, and
it is a program of the submission.
"""
import ast
import codecs
import importlib
import os
import shutil
import sys
from collections import Counter
from dataclasses import dataclass, field
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Set, Tuple

from tb3_labs.command_line import printable
from tb3_labs.marking.interfaces import build, let_stand_in, offers_modules, types_used
from tb3_labs.marking.marks import Lab
from tb3_labs.marking.packages import (
    MANIFEST, NAME, NoNode, find_node, name_in, packages_in, source_of)
from tb3_labs.marking.processes import MODULES, PREFIXES
from tb3_labs.marking.sandbox import OWN_PACKAGE, NoSandbox

#: If a program catches one of these errors around an import, it runs without the module.
CAUGHT = {'ImportError', 'ModuleNotFoundError', 'Exception', 'BaseException'}
#: The name of a package in the copy if its own name cannot be used.
SUBSTITUTE = 'submission'
SUBSTITUTE_MANIFEST = '''<package format="2"><name>{}</name><version>0.0.0</version>
<description>-</description><maintainer email="nobody@example.org">-</maintainer>
<license>-</license></package>
'''
#: The name of a node's file in the copy if its own name cannot be used.
SUBSTITUTE_NODE = 'node.py'
SHEBANG = '#!/usr/bin/env python3'


@dataclass
class Prepared:
    """A copy that can run: ``rosrun package executable`` with this `environment`."""

    package: str
    executable: str
    environment: Dict[str, str]
    types: Optional[Dict[str, Any]]     # see interfaces.describe; None without types
    remarks: List[str] = field(default_factory=list)      # sentences
    lacking: List[str] = field(default_factory=list)      # modules that the node lacks


def prepare(folder: Path, lab: Lab, workspace: Path, variables: Mapping[str, str],
            package: str = '', name: str = '', sandbox: NoSandbox = NoSandbox()) -> Prepared:
    """The Prepared of a Lab's node below `folder`; `package`, `name`: of the node, if given.

    `folder` is a copy of the submission as Submission.lay_out() makes it: it has no links. Its
    packages are copied into `workspace`, the node is repaired, and the Python modules that it
    needs are built, in `sandbox`. The environment has these `variables` too. ``NoNode`` if no
    file can be the node, or if the node cannot be copied.
    """
    node, remarks = find_node(folder, lab, package, name)
    source = source_of(node, folder)
    packages = packages_in(folder, node)
    let_stand_in(node, packages, workspace / 'given', remarks)
    needed = [other for other in needed_by(node, packages) if other != OWN_PACKAGE]
    try:
        copies = {source: shutil.copytree(source, workspace / 'src' / 'package', symlinks=True)}
        called = _name(source, copies[source] / MANIFEST, needed, remarks)
        copied = _called_properly(copies[source] / node.relative_to(source), remarks)
        _repair(copied, remarks)
        for number, other in enumerate(needed, 1):
            if packages[other] not in copies:
                copies[packages[other]] = shutil.copytree(
                    packages[other], workspace / 'src' / 'other{}'.format(number), symlinks=True)
    except OSError as problem:
        raise NoNode('It cannot be copied: {}.'.format(problem)) from None
    environment, modules = dict(os.environ, **variables), workspace / 'python'
    environment['ROS_PACKAGE_PATH'] = '{}:{}'.format(
        workspace / 'src', environment.get('ROS_PACKAGE_PATH', ''))
    # if a package of this name was built there, rosrun would ask which of the two is meant
    environment[PREFIXES] = ':'.join(
        prefix for prefix in environment.get(PREFIXES, '').split(':')
        if not os.path.isdir(os.path.join(prefix, 'lib', called)))
    types = build({called if packages[other] == source else other: copies[packages[other]]
                   for other in needed}, modules, environment, remarks, sandbox)
    environment[MODULES] = ':'.join(filter(None, [str(modules), environment.get(MODULES)]))
    offering = {name for name, folder in packages.items() if offers_modules(folder)}
    lacking = _leave_out_lacking(copied, offering, modules, remarks)
    return Prepared(called, copied.name, environment, types, remarks, lacking)


def _leave_out_lacking(node, packages, modules, remarks):
    """Remove unused imports of modules that are not found. Returns the used modules not found.

    `packages`: names of the submission's packages that offer modules; `modules`: folder of the
    built modules.
    """
    text = node.read_bytes().decode(errors='replace')
    imports = [item for item in imports_of(text) if not item.guarded]
    named = set().union(*(item.packages for item in imports)) - packages
    importlib.invalidate_caches()
    path = [str(node.parent), str(modules)] + sys.path[1:]
    missing = {name for name in named if name not in sys.builtin_module_names
               and PathFinder.find_spec(name, path) is None}    # does not import them
    unused = [item for item in imports if item.packages & missing and not item.used]
    if unused:
        node.write_text(without(text, unused), encoding='utf-8')
        remarks.append('{}: imported, but not used, and not found on the marking machine: left '
                       'out.'.format(', '.join(sorted(
                           module for item in unused for module in item.modules))))
    return sorted(set().union(*(item.packages & missing for item in imports if item.used), ()))


def _called_properly(node, remarks):
    """Returns the file of a node; it is renamed if its name is unsafe for roslaunch and rosrun."""
    if NAME.fullmatch(node.stem if node.suffix == '.py' else node.name):
        return node
    remarks.append('The file {} got another name, since ROS allows letters, digits and _ in it.'
                   .format(printable(node.name)))
    return node.rename(node.with_name(SUBSTITUTE_NODE))


def _name(source, manifest, needed, remarks):
    """Returns a usable name of the package; if it is a new one, writes a package.xml with it."""
    name, problem = name_in(manifest)
    if name and name != OWN_PACKAGE:
        return name
    remarks.append(problem or 'The package is called {}, as this one: it got another name.'.format(
        name))
    # its node may import messages by the folder's name
    name = source.name if source.name in needed else SUBSTITUTE
    manifest.write_text(SUBSTITUTE_MANIFEST.format(name), encoding='utf-8')
    return name


def _repair(node, remarks):
    code = node.read_bytes()
    if code.startswith(codecs.BOM_UTF8):
        code = code[len(codecs.BOM_UTF8):]
        remarks.append('{} begins with a byte order mark: removed.'.format(node.name))
    if b'\r' in code:
        code = code.replace(b'\r\n', b'\n')
        remarks.append('{} has Windows line endings: changed.'.format(node.name))
    if not code.startswith(b'#!'):
        remarks.append('{} does not begin with {}, so that rosrun cannot start it.'.format(
            node.name, SHEBANG))
    if not os.access(str(node), os.X_OK):
        remarks.append('{} is not executable: it was made so.'.format(node.name))
    node.write_bytes(code)
    node.chmod(0o755)


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
        found.append(Import(modules, lines[0], lines[-1], not alone or '*' in bound or bool(
            bound & used), id(node) in guarded))
    return sorted(found, key=lambda item: item.first)


def _catches(handler):
    return handler.type is None or any(
        isinstance(node, ast.Name) and node.id in CAUGHT for node in ast.walk(handler.type))


def without(text: str, imports: List[Import]) -> str:
    """The program without these imports: they become comments, other lines keep their numbers."""
    lines = text.splitlines(True)
    for item in imports:
        begin = item.first - 1
        indent = lines[begin][:-len(lines[begin].lstrip())]
        for number in range(begin, item.last):
            lines[number] = '{}{}# {}'.format(
                indent, 'pass    ' * (number == begin), lines[number].lstrip())
    return ''.join(lines)


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
