"""A workspace with a copy of a student's package that can run.

Some faults keep a node from running and say nothing about it: no exec bit, Windows line endings, a
wrong first line, no package.xml. They are repaired in the copy, and told in a remark.
"""
import os
import re
import shutil
from dataclasses import dataclass, field
from pathlib import Path

from tb3_labs.ros.marking.box import NoBox
from tb3_labs.ros.marking.catkin_build import build, needs_build
from tb3_labs.ros.marking.submission import (LEFT_OUT, MANIFEST, Unusable, files_in, find_node,
                                             name_in, source_of)

OWN_PACKAGE = 'tb3_labs'
#: The name of a package in the copy if its own name cannot be used.
SUBSTITUTE = 'submission'
SUBSTITUTE_MANIFEST = '''<package format="2"><name>{}</name><version>0.0.0</version>
<description>-</description><maintainer email="nobody@example.org">-</maintainer>
<license>-</license></package>
'''
#: Larger files are not copied [bytes].
LARGEST = 20000000
SHEBANG = b'#!/usr/bin/env python3'
BYTE_ORDER_MARK = b'\xef\xbb\xbf'


@dataclass
class Prepared:
    """A copy that can run: ``rosrun package executable`` with this `environment`."""

    package: str
    executable: str
    environment: dict
    remarks: list = field(default_factory=list)      # sentences


def prepare(folder, names, workspace, build_log, variables=(), box=NoBox()):
    """The Prepared of the node below `folder`, a file with one of these `names`.

    Its packages are copied into `workspace`, the node is repaired, and what needs a build is built;
    the build prints into the file `build_log`, and runs in the `box`. The environment has these
    `variables` too. ``Unusable`` if there is no such node, or if it cannot be copied.
    """
    folder, workspace = Path(folder), Path(workspace)
    node, remarks = find_node(folder, names)
    source = source_of(node, folder)
    try:
        copy = _copy(source, workspace / 'src' / 'package')
        package = _name(copy / MANIFEST, remarks)
        _repair(copy / node.relative_to(source), remarks)
        copies = [copy] + _copy_others(folder, source, package, workspace / 'src')
    except OSError as problem:
        raise Unusable('It cannot be copied: {}.'.format(problem)) from None
    environment = dict(os.environ, **dict(variables))
    environment['ROS_PACKAGE_PATH'] = '{}:{}'.format(
        workspace / 'src', environment.get('ROS_PACKAGE_PATH', ''))
    if package != SUBSTITUTE and any(needs_build(copy) for copy in copies):
        environment = build(workspace, build_log, environment, remarks, box) or environment
    return Prepared(package, node.name, environment, remarks)


def _copy(source, target):
    shutil.copytree(str(source), str(target), symlinks=True, ignore=_left_out)
    return target


def _copy_others(folder, source, package, target):
    """Copy the other packages of a submission, such as one of messages; of each name the first."""
    copies, known = [], {package, OWN_PACKAGE}
    for path in files_in(folder):
        if path.name == MANIFEST and path.parent != source and (
                source not in path.parents and path.parent not in source.parents):
            name, _ = name_in(path)
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
    """The package's name; if it cannot be used, a package.xml with another name is written."""
    name, problem = name_in(manifest)
    if name and name != OWN_PACKAGE:
        return name
    remarks.append(problem or 'The package is called {}, as this one: it got another name.'.format(
        name))
    manifest.write_text(SUBSTITUTE_MANIFEST.format(SUBSTITUTE), encoding='utf-8')
    return SUBSTITUTE


def _repair(node, remarks):
    """Make a node's file one that Linux starts by python3."""
    code = node.read_bytes()
    if code.startswith(BYTE_ORDER_MARK):
        code = code[len(BYTE_ORDER_MARK):]
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
