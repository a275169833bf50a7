"""A workspace with a copy of a student's package that can run.

Some faults come from Windows or from the way of a file to the marking machine: no exec bit, line
endings, a byte order mark. They are repaired in the copy. A name that a command line or a package
cannot have is replaced; an unused import of a module that this machine lacks is left out. A remark
tells each of these.

A Python node needs nothing else of a build: messages, services, and the modules of a setup.py.
catkin is not run. A CMakeLists.txt often needs packages that the marking machine does not have, and
it is a program of the submission.
"""
import codecs
import importlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from functools import lru_cache
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional

import rospkg

from tb3_labs.command_line import printable
from tb3_labs.marking import messages_in_sandbox
from tb3_labs.marking.choice import NoNode, find_node, source_of
from tb3_labs.marking.marks import Lab
from tb3_labs.marking.names import NAME, is_name
from tb3_labs.marking.packages import (ACTIONS, INTERFACES, MANIFEST, MESSAGES, SERVICES, Import,
                                       imports_of, interface_files, name_in, needed_by,
                                       packages_in)
from tb3_labs.marking.processes import MODULES, PREFIXES
from tb3_labs.marking.sandbox import OWN_PACKAGE, NoSandbox

MODULE = re.compile(r'_[A-Za-z0-9_]+\.py')
#: The import of the message that the course gives: the skeletons have it, and this package.
GIVEN = 'MouseController'
IMPORTS_GIVEN = re.compile(r'^[ \t]*from[ \t]+(\w+)\.msg[ \t]+import[ \t(]+{}\b'.format(GIVEN),
                           re.MULTILINE)
#: All messages of a submission are built within this time [s].
BUILD_TIME = 30.0
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
    types: Optional[Dict[str, Any]]     # see messages_in_sandbox; None without types
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
    _let_stand_in(node, packages, workspace / 'given', remarks)
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
    offering = {name for name, folder in packages.items() if _offers_modules(folder)}
    lacking = _leave_out_lacking(copied, offering, modules, remarks)
    return Prepared(called, copied.name, environment, types, remarks, lacking)


def _let_stand_in(node, packages, folder, remarks):
    """Add to `packages` those whose GIVEN the node imports, if they were not handed in."""
    for name in sorted(set(IMPORTS_GIVEN.findall(node.read_bytes().decode(errors='replace')))):
        if is_name(name) and name not in packages and PathFinder.find_spec(name) is None:
            packages[name] = folder / name
            (folder / name / MESSAGES).mkdir(parents=True)
            shutil.copy(os.path.join(rospkg.RosPack().get_path(OWN_PACKAGE), MESSAGES,
                                     '{}.{}'.format(GIVEN, MESSAGES)), str(folder / name / MESSAGES))
            remarks.append('The package {} was not handed in: the message {} of the skeleton stands '
                           'in for its own.'.format(name, GIVEN))


def _offers_modules(package):
    """Does a package folder have anything that can be imported by the package's name?"""
    return any((package / part).exists() for part in (*INTERFACES, 'setup.py'))


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


# -- what is built for a node

def build(packages: Dict[str, Path], folder: Path, environment: Dict[str, str], remarks: List[str],
          sandbox: NoSandbox) -> Optional[Dict[str, Any]]:
    """Make the Python modules of `packages`, {name: folder}, below `folder`. Returns the
    description of their types, see messages_in_sandbox; None if they define none.

    `environment`: for the sandbox that reads the messages. Sentences are added to `remarks`.
    """
    files: List[List[str]] = []
    for name, package in packages.items():
        own = package / 'src' / name
        if (package / 'setup.py').exists() and own.is_dir():
            shutil.copytree(str(own), str(folder / name))
        files += _definitions(name, package, remarks)
    if not files:
        return None
    done = _read({'search': system_messages(), 'definitions': files}, environment, sandbox)
    if done is None:
        remarks.append('The messages and services could not be built.')
        done = {'modules': [], 'problems': {}, 'fields': {}, 'sums': {}}
    for package_name, kind, name, text in done['modules']:
        if not (package_name in packages and kind in (MESSAGES, SERVICES)
                and MODULE.fullmatch(name)):
            raise ValueError('a module is called {!r}'.format([package_name, kind, name]))
        place = folder / package_name / kind
        place.mkdir(parents=True, exist_ok=True)
        (place / name).write_text(text, encoding='utf-8')
        (folder / package_name / '__init__.py').touch()
    for name, problem in sorted(done['problems'].items()):
        remarks.append('{} cannot be built: {}.'.format(
            name, ' '.join(problem.split()).rstrip('.')))
    return done


def _definitions(name, package, remarks):
    files = interface_files(package)
    if files[ACTIONS]:
        remarks.append('{} has actions: they were not built.'.format(name))
    for kind in (MESSAGES, SERVICES):
        for file in files[kind]:
            stem = file[:-len(kind) - 1]
            if is_name(stem):
                text = (package / kind / file).read_text(encoding='utf-8', errors='replace')
                yield [name, kind, stem, text]
            else:
                remarks.append('{}/{} was not built: ROS allows letters, digits and _ in the name '
                               'of a type.'.format(name, printable(file)))


def _read(request, environment, sandbox):
    """Returns the answer of messages_in_sandbox; None if there is none.

    The answer comes in a file, since a program in a sandbox cannot write a large file.
    """
    command = ['python3', '-c', Path(messages_in_sandbox.__file__).read_text()]
    with tempfile.TemporaryFile('w+') as asked, tempfile.TemporaryFile('w+') as answer:
        json.dump(request, asked)
        asked.seek(0)
        try:
            subprocess.run(sandbox.own_network(sandbox.command(command)), stdin=asked,
                           stdout=answer, stderr=subprocess.DEVNULL, timeout=BUILD_TIME,
                           env=sandbox.environment(environment), check=True)
            answer.seek(0)
            return json.load(answer)
        except (subprocess.SubprocessError, ValueError):
            return None


@lru_cache(maxsize=None)
def system_messages() -> Dict[str, List[str]]:
    """Returns name -> folders of its messages, for all ROS packages of this machine; cached."""
    # A RosPack changes while it is asked: each thread that comes first has its own.
    ros = rospkg.RosPack()
    folders = {name: os.path.join(ros.get_path(name), MESSAGES) for name in ros.list()}
    return {name: [folder] for name, folder in folders.items() if os.path.isdir(folder)}
