"""A workspace with a copy of a student's package that can run.

Some faults keep a node from running and have nothing to do with its work: no exec bit, Windows line
endings, a wrong first line, no package.xml, an unused import. They are repaired in the copy, and
told in a remark.
"""
import codecs
import importlib
import os
import re
import shutil
import sys
from dataclasses import dataclass, field
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Union

from tb3_labs.marking.choice import NoNode, find_node, source_of
from tb3_labs.marking.labs import Lab
from tb3_labs.marking.messages import build
from tb3_labs.marking.names import NAME, printable
from tb3_labs.marking.packages import (
    MANIFEST, imports_of, name_in, needed_by, packages_in, without)
from tb3_labs.marking.processes import MODULES, PREFIXES
from tb3_labs.marking.sandbox import OWN_PACKAGE, NoSandbox, Sandbox

#: The name of a package in the copy if its own name cannot be used.
SUBSTITUTE = 'submission'
SUBSTITUTE_MANIFEST = '''<package format="2"><name>{}</name><version>0.0.0</version>
<description>-</description><maintainer email="nobody@example.org">-</maintainer>
<license>-</license></package>
'''
#: The name of a node's file in the copy, likewise.
SUBSTITUTE_NODE = 'node.py'
SHEBANG = b'#!/usr/bin/env python3'


@dataclass
class Prepared:
    """A copy that can run: ``rosrun package executable`` with this `environment`."""

    package: str
    executable: str
    environment: Dict[str, str]
    types: Optional[Dict[str, Any]]     # see messages_in_sandbox; None: it brings no types
    remarks: List[str] = field(default_factory=list)      # sentences
    lacking: List[str] = field(default_factory=list)      # modules that the node needs, not found


def prepare(folder: Path, lab: Lab, workspace: Path, variables: Mapping[str, str],
            package: str = '', name: str = '',
            sandbox: Union[Sandbox, NoSandbox] = NoSandbox()) -> Prepared:
    """The Prepared of a Lab's node below `folder`; `package` and `name` of the node, if given.

    `folder` is a copy of the submission as Submission.lay_out() makes it: it has no links. Its
    packages are copied into `workspace`, the node is repaired, and the Python modules that it
    needs are built, in `sandbox`. The environment has these `variables` too. ``NoNode`` if there is
    no such node, or if it cannot be copied.
    """
    node, remarks = find_node(folder, lab, package, name)
    source = source_of(node, folder)
    packages = packages_in(folder, node)
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
    # rosrun would find the programs of a package of this name that was built there, and ask
    environment[PREFIXES] = ':'.join(
        prefix for prefix in environment.get(PREFIXES, '').split(':')
        if not os.path.isdir(os.path.join(prefix, 'lib', called)))
    types = build({called if packages[other] == source else other: copies[packages[other]]
                   for other in needed}, modules, environment, remarks, sandbox)
    environment[MODULES] = ':'.join(filter(None, [str(modules), environment.get(MODULES)]))
    lacking = _leave_out_lacking(copied, set(packages), modules, remarks)
    return Prepared(called, copied.name, environment, types, remarks, lacking)


def _leave_out_lacking(node, packages, modules, remarks):
    """Take out the imports that are neither found nor used; the modules that are used, not found.

    `packages`: names of those of the submission; `modules`: folder of the built ones."""
    text = node.read_bytes().decode(errors='replace')
    imports = [item for item in imports_of(text) if not item.guarded]
    named = set().union(*(item.packages for item in imports)) - packages
    importlib.invalidate_caches()
    path = [str(node.parent), str(modules)] + sys.path[1:]
    missing = {name for name in named if name not in sys.builtin_module_names
               and PathFinder.find_spec(name, path) is None}    # they are not imported here
    unused = [item for item in imports if item.packages & missing and not item.used]
    if unused:
        node.write_text(without(text, unused), encoding='utf-8')
        remarks.append('{}: imported, but not used, and not found on the marking machine: left '
                       'out.'.format(', '.join(sorted(
                           module for item in unused for module in item.modules))))
    return sorted(set().union(*(item.packages & missing for item in imports if item.used), ()))


def _called_properly(node, remarks):
    """The file of a node, with another name if roslaunch and rosrun may take its own for more."""
    if NAME.fullmatch(node.stem if node.suffix == '.py' else node.name):
        return node
    remarks.append('The file {} got another name, since ROS allows letters, digits and _ in it.'
                   .format(printable(node.name)))
    return node.rename(node.with_name(SUBSTITUTE_NODE))


def _name(source, manifest, needed, remarks):
    """The package's name; if it cannot be used, a package.xml with another name is written."""
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
    first, _, rest = code.partition(b'\n')
    if not re.match(rb'^#! ?(/usr/bin/env python3|/usr/bin/python3)\s*$', first):
        remarks.append('The first line of {} is {!r}: started by python3.'.format(
            node.name, first[:60].decode(errors='replace')))
        code = SHEBANG + b'\n' + (rest if first.startswith(b'#!') else code)
    if not os.access(str(node), os.X_OK):
        remarks.append('{} is not executable: it was made so.'.format(node.name))
    node.write_bytes(code)
    node.chmod(0o755)
