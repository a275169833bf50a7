"""What a student handed in: finds the node, makes a copy of its package that can run.

Nothing is changed in the submission itself. What keeps a node from running and says nothing about
it (a missing exec bit, Windows line endings, a wrong first line, no package.xml) is repaired in
the copy, and told.
"""
import os
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, field
from pathlib import Path

OWN_PACKAGE = 'tb3_labs'
#: What a package is called in the copy if its own name is of no use.
SUBSTITUTE = 'submission'
MANIFEST = '''<package format="2"><name>{}</name><version>0.0.0</version>
<description>-</description><maintainer email="nobody@example.org">-</maintainer>
<license>-</license></package>
'''
#: Not copied; nor are files larger than this [bytes].
LEFT_OUT = ('.git', '.svn', 'build', 'devel', 'install', 'logs', '__pycache__', '*.bag', '*.zip')
LARGEST = 20000000
#: A build takes no longer than this [s].
BUILD_TIME = 180.0
SHEBANG = b'#!/usr/bin/env python3'
#: Where nodes usually are, likeliest first.
FOLDERS = ('scripts', 'nodes', 'src')


class Unusable(Exception):
    """There is nothing in a submission that could be run; the reason, as one sentence."""


@dataclass
class Prepared:
    """A copy that can run: ``rosrun package executable`` with this `environment`."""

    package: str
    executable: str
    environment: dict
    remarks: list = field(default_factory=list)


def find_node(folder, names):
    """The path of the node below `folder`: a file with one of these names; and remarks."""
    files = [path for path in _files(folder) if path.suffix == '.py' or not path.suffix]
    for name in names:
        found = [path for path in files if path.name == name] or [
            path for path in files if path.name.lower() == name.lower()]
        if found:
            found.sort(key=lambda path: (_package_folder(path, folder) is None, _rank(path),
                                         str(path)))
            remarks = [] if len(found) == 1 else ['{} files are called {}; judged was {}.'.format(
                len(found), name, found[0].relative_to(folder))]
            return found[0], remarks
    others = sorted(str(path.relative_to(folder)) for path in files if path.suffix == '.py')
    raise Unusable('There is no {}. {}'.format(
        ' or '.join(names), 'Python files that were found (--type NAME judges another one): '
        + ', '.join(others[:10]) if others else 'No Python file was found at all.'))


def _files(folder):
    for root, folders, files in os.walk(str(folder)):
        folders[:] = sorted(name for name in folders if name not in LEFT_OUT)
        for name in sorted(files):
            path = Path(root) / name
            if path.is_file() and not path.is_symlink():
                yield path


def _rank(path):
    parent = path.parent.name
    return FOLDERS.index(parent) if parent in FOLDERS else len(FOLDERS)


def _package_folder(path, folder):
    """The nearest folder above that has a package.xml, within the submission; None without."""
    for parent in path.parents:
        if (parent / 'package.xml').is_file():
            return parent
        if parent == folder:
            return None
    return None


def prepare(folder, names, workspace, build_log, variables=()):
    """Copy the packages below `folder` into `workspace`, repair the node, build if need be;
    Prepared, with these environment `variables` too. ``Unusable`` with the reason where there is
    no such node."""
    folder, workspace = Path(folder), Path(workspace)
    node, remarks = find_node(folder, names)
    source = _package_folder(node, folder)
    if source is None:
        source = node.parent.parent if node.parent.name in FOLDERS and node.parent != folder \
            else node.parent
    try:
        copy = _copy(source, workspace / 'src' / 'package')
        package = _name(copy / 'package.xml', remarks)
        _repair(copy / node.relative_to(source), remarks)
        copies = [copy] + _copy_others(folder, source, package, workspace / 'src')
    except OSError as problem:
        raise Unusable('It cannot be copied: {}'.format(problem)) from None
    environment = dict(os.environ, **dict(variables))
    environment['ROS_PACKAGE_PATH'] = '{}:{}'.format(
        workspace / 'src', environment.get('ROS_PACKAGE_PATH', ''))
    if package != SUBSTITUTE and any(_needs_build(copy) for copy in copies):
        environment = _build(workspace, build_log, environment, remarks) or environment
    return Prepared(package, node.name, environment, remarks)


def _copy(source, target):
    shutil.copytree(str(source), str(target), symlinks=True, ignore=_left_out)
    return target


def _copy_others(folder, source, package, target):
    """What else was handed in, such as a package of messages; of each name the first."""
    copies, known = [], {package, OWN_PACKAGE}
    for path in _files(folder):
        if path.name == 'package.xml' and path.parent != source and (
                source not in path.parents and path.parent not in source.parents):
            name, _ = _name_in(path)
            if name and name not in known:
                known.add(name)
                copies.append(_copy(path.parent, target / 'other{}'.format(len(copies) + 1)))
    return copies


def _left_out(folder, names):
    ignored = set(shutil.ignore_patterns(*LEFT_OUT)(folder, names))
    for name in names:
        path = os.path.join(folder, name)
        if not os.path.islink(path) and not os.path.isdir(path) and (
                not os.path.isfile(path) or os.path.getsize(path) > LARGEST):
            ignored.add(name)
    return ignored


def _name(manifest, remarks):
    """The package's name; where there is none of use, a package.xml with another is written."""
    name, problem = _name_in(manifest)
    if name and name != OWN_PACKAGE:
        return name
    remarks.append(problem or 'The package is called {}, as this one: it got another name.'.format(
        name))
    manifest.write_text(MANIFEST.format(SUBSTITUTE), encoding='utf-8')
    return SUBSTITUTE


def _name_in(manifest):
    """The name in a package.xml, or '' and why there is none."""
    if not manifest.is_file():
        return '', 'The package has no package.xml: one was made.'
    try:
        name = (ElementTree.parse(str(manifest)).getroot().findtext('name') or '').strip()
    except ElementTree.ParseError as error:
        return '', 'package.xml cannot be read ({}): one was made.'.format(error)
    if re.match(r'^[A-Za-z][\w-]*$', name):
        return name, ''
    return '', 'The package is called {!r}: it got another name.'.format(name)


def _repair(node, remarks):
    code = node.read_bytes()
    if code.startswith(b'\xef\xbb\xbf'):
        code = code[3:]
        remarks.append('{} begins with a byte order mark: removed.'.format(node.name))
    if b'\r' in code:
        code = code.replace(b'\r\n', b'\n')
        remarks.append('{} has Windows line endings: changed.'.format(node.name))
    first, _, rest = code.partition(b'\n')
    if not re.match(rb'^#! ?(/usr/bin/env python3|/usr/bin/python3)\s*$', first):
        remarks.append('The first line of {} is {!r}: started by python3.'.format(
            node.name, first[:60].decode(errors='replace')))
        code = SHEBANG + b'\n' + (rest if first.startswith(b'#!') else code)
    if not os.access(str(node), os.X_OK):
        remarks.append('{} is not executable: it was made so.'.format(node.name))
    node.write_bytes(code)
    node.chmod(0o755)


def _needs_build(package):
    return (package / 'CMakeLists.txt').is_file() and any(
        (package / name).exists() for name in ('msg', 'srv', 'action', 'setup.py'))


def _build(workspace, log, environment, remarks):
    """The environment of the built workspace, or None."""
    command = ['catkin_make', '--directory', str(workspace),
               '-DPYTHON_EXECUTABLE=' + sys.executable, '-DCATKIN_ENABLE_TESTING=0']
    with open(str(log), 'w') as file:
        try:
            status = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=file, stderr=file,
                                    env=environment, timeout=BUILD_TIME).returncode
        except subprocess.TimeoutExpired:
            status = None
    if status != 0:
        lines = [line.strip() for line in Path(log).read_text(errors='replace').splitlines()
                 if line.strip()]
        errors = [line for line in lines
                  if re.search(r'CMake Error|[Ee]rror:|Could not find', line)]
        remarks.append('catkin_make failed, it was run without: {}'.format(
            'it took longer than {:g} s'.format(BUILD_TIME) if status is None
            else (errors + lines[-1:] + ['it printed nothing'])[0][:150]))
        return None
    text = subprocess.run(['bash', '-c', 'source "$0" && env -0',
                           str(workspace / 'devel' / 'setup.bash')],
                          env=environment, stdout=subprocess.PIPE, check=True).stdout
    return dict(item.split('=', 1) for item in os.fsdecode(text).split('\0') if '=' in item)
