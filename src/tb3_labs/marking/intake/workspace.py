"""Turns the copy of a submission into a workspace in which its node can run.

This module repairs the node's file in the copy. An empty module replaces a missing module that the
node imports but never uses. The student gets a remark on each repair.

catkin is not run, because a CMakeLists.txt is a program of the submission, and often needs
packages that are not on the marking machine. A Python node needs only messages, services, and the
modules of a setup.py. message_examples.py makes the modules of messages and services in a sandbox.
"""
import codecs
import json
import os
import re
import shutil
import subprocess
import tempfile
from functools import lru_cache
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional

import rospkg

from tb3_labs.command_line import printable
from tb3_labs.marking.intake.packages import (
    DEFINITION_KINDS, MESSAGES, definition_files, module_folders)
from tb3_labs.marking.intake.sandbox import PYTHONPATH, Protection
from tb3_labs.marking.intake.submissions import ParsedSubmission
from tb3_labs.marking.limits import LIMIT_READER_COMMAND
from tb3_labs.marking.student_nodes import (
    NAME_PATTERN, NODE_PREFIX, OWN_PACKAGE, NodeStart, is_valid_name)
from tb3_labs.watch import PROBE, with_probe

#: Matches a first line such as #!/usr/bin/env python3. The group is the interpreter's name.
PYTHON_SHEBANG = re.compile(rb'#! *(?:\S*/env +)?(\S*python[\d.]*)')
#: The text of an empty module. Each name that a program imports from an empty module is None.
EMPTY_MODULE = '''def __getattr__(name):
    if name.startswith('__'):
        raise AttributeError(name)
'''
MAX_PACKAGES = 20           # only the packages nearest to the node are built
MAKE_MODULES_PROGRAM = Path(__file__).with_name('message_examples.py').read_text(encoding='utf-8')
#: A regular expression for the names of the files that MAKE_MODULES_PROGRAM makes.
MODULE_FILE_NAME = re.compile(r'_[A-Za-z0-9_]+\.py')
BUILD_TIMEOUT = 30.0        # [s]
COPY_FOLDER = 'src'         # the folder in a workspace into which the submission is copied


def prepare_workspace(parsed: ParsedSubmission, workspace: Path, environment: Mapping[str, str],
                      protection: Protection = Protection()) -> NodeStart:
    """Make a workspace of the submission in `workspace`/COPY_FOLDER. Returns the NodeStart.
    The node's environment is `environment` with the folders of the workspace. Remarks and findings
    are added to `parsed`. `protection` limits the program that makes the messages."""
    copy = workspace / COPY_FOLDER
    python_folder = workspace / 'python'
    package = copy / parsed.package_folder
    node = copy / parsed.node
    remarks = parsed.remarks
    # a repository's copy of geometry_msgs must not replace the geometry_msgs of this machine
    own_names = [name for name in parsed.packages if name not in system_messages()]
    nearest_names = own_names[-MAX_PACKAGES:]
    packages = {name: copy / parsed.packages[name] for name in nearest_names}
    _repair_node(node, remarks, parsed.findings)

    environment = dict(environment)
    package_folders = dict.fromkeys([package, *packages.values()])
    _put_folders_first(package_folders, environment, 'ROS_PACKAGE_PATH')
    types = build_types(packages, node, python_folder, environment, remarks, protection)
    _make_empty_modules(parsed.unused_modules, python_folder)
    if parsed.unused_modules:
        remarks.append(f"{', '.join(parsed.unused_modules)}: imported, but not used, and the "
                       'marking machine cannot import it: left out.')
    _put_folders_first([python_folder], environment, PYTHONPATH)
    environment = with_probe(environment, shutil.copytree(str(PROBE), str(workspace / 'probe')))
    return NodeStart(
        NODE_PREFIX + protection.program_command([]),
        protection.program_environment(environment), types, protection.is_sandbox, str(node),
        _shown_name(parsed.package_name, node.name), str(copy))


def _put_folders_first(folders, environment, variable):
    paths = [*map(str, folders), environment.get(variable, '')]
    environment[variable] = ':'.join(path for path in paths if path)


def _make_empty_modules(modules, python_folder):
    for module in modules:
        module_folder = python_folder
        for name in module.split('.'):
            module_folder /= name
            module_folder.mkdir(exist_ok=True)
            init_file = module_folder / '__init__.py'
            if not init_file.exists():      # a module of the submission is not replaced
                init_file.write_text(EMPTY_MODULE)


def _shown_name(package, file):
    """Returns the text package/file for roslaunch and for the pages. An invalid package becomes
    'submission', and an invalid file becomes 'node.py'."""
    shown_package = 'submission' if package in ('', OWN_PACKAGE) else package
    stem = file[:-len('.py')] if file.endswith('.py') else file
    shown_file = file if NAME_PATTERN.fullmatch(stem) else 'node.py'
    return f'{shown_package}/{shown_file}'


def _repair_node(node, remarks, findings):
    code = node.read_bytes()
    repairs = []
    if code.startswith(codecs.BOM_UTF8):
        code = code[len(codecs.BOM_UTF8):]
        repairs.append('begins with a byte order mark: removed')
    if b'\r\n' in code:
        code = code.replace(b'\r\n', b'\n')
        repairs.append('has Windows line endings: changed')
    first_line = code.partition(b'\n')[0]
    shebang = PYTHON_SHEBANG.match(first_line)
    if not code.startswith(b'#!'):
        repairs.append('does not begin with #!/usr/bin/env python3, so that rosrun cannot start it')
        findings.append('It does not begin with #!/usr/bin/env python3: if its CMakeLists.txt has '
                        'catkin_install_python, it may run on another machine.')
    elif shebang and not shutil.which(os.fsdecode(shebang.group(1))):
        findings.append(f'It begins with {printable(os.fsdecode(first_line[:80]))}, which this '
                        'machine lacks: on another one it may run.')
    if not os.access(str(node), os.X_OK):
        repairs.append('is not executable: it was made so')
    remarks += [f'{node.name} {repair}.' for repair in repairs]
    node.write_bytes(code)
    node.chmod(0o755)


def build_types(packages: Dict[str, Path], node: Path, folder: Path, environment: Dict[str, str],
                remarks: List[str], protection: Protection) -> Optional[Dict[str, Any]]:
    """Make the Python modules of `packages` in `folder`. Returns the result of message_examples.py,
    or None if the packages define no type. `packages` is a dict {name: folder}. Problems of a
    package are added to `remarks` if the code of `node` names the package."""
    folder.mkdir()
    _link_modules(packages, node, folder)
    definitions = _definitions(packages)
    if not definitions:
        return None
    try:
        built = _run_make_modules(definitions, environment, protection)
    except (subprocess.SubprocessError, ValueError):
        remarks.append('The messages and services could not be built.')
        built = {'modules': [], 'problems': {}, 'msg': {}, 'srv': {}}
    for package_name, kind, name, text in built['modules']:
        is_known_folder = package_name in packages and kind in DEFINITION_KINDS
        if not (is_known_folder and MODULE_FILE_NAME.fullmatch(name)):
            raise ValueError(f'a module is called {[package_name, kind, name]!r}')
        module_folder = folder / package_name / kind
        module_folder.mkdir(parents=True, exist_ok=True)
        (module_folder / name).write_text(text, encoding='utf-8')
        (folder / package_name / '__init__.py').touch()
    node_text = node.read_text(encoding='utf-8', errors='replace')
    for path, problem in sorted(built['problems'].items()):
        package_name, _, file = path.split(os.sep)
        if package_name in node_text:
            # the end of genmsg's text names folders of the marking machine
            reason = re.split(' on search path | with paths ', ' '.join(problem.split()))[0]
            remarks.append(f"{package_name}/{file} cannot be built: {reason.rstrip('.')}.")
    return built


def _link_modules(packages, node, folder):
    """Make links in `folder` to the modules of packages. Python looks for a package's modules and
    messages in one folder, so the messages will be made behind the link, beside the modules."""
    module_sources = {source.name: source for name, package in packages.items()
                      for source in module_folders(package, name)}
    # Python first looks for a module in the node's folder
    module_sources.update({name: node.parent / name for name in packages
                           if (node.parent / name / '__init__.py').is_file()})
    for name, source in module_sources.items():
        (folder / name).symlink_to(source)


def _definitions(packages):
    """Returns [package, 'msg' or 'srv', name, text] of each message and service. Files whose names
    are invalid are left out."""
    definitions = []
    for package_name, package in packages.items():
        for path in definition_files(package):
            if is_valid_name(path.stem):
                text = path.read_text(encoding='utf-8', errors='replace')
                definitions.append([package_name, path.suffix.lstrip('.'), path.stem, text])
    return definitions


def _run_make_modules(definitions, environment, protection):
    # the sandbox limits the size of a file but not of a pipe, so the answer is a file
    with tempfile.TemporaryFile('w+') as answer:
        subprocess.run(
            protection.check_command(protection.program_command(
                LIMIT_READER_COMMAND + ['python3', '-c', MAKE_MODULES_PROGRAM])),
            input=json.dumps({'search': system_messages(), 'definitions': definitions}),
            stdout=answer, stderr=subprocess.DEVNULL, timeout=BUILD_TIMEOUT, check=True, cwd='/',
            env=protection.program_environment(environment), universal_newlines=True)
        answer.seek(0)
        return json.load(answer)


@lru_cache(maxsize=None)
def system_messages() -> Dict[str, List[str]]:
    """Returns {name: [folder of messages, which may be missing]} of this machine's ROS packages."""
    # a RosPack changes during a query, so two threads must not share a RosPack
    ros = rospkg.RosPack()
    return {name: [os.path.join(ros.get_path(name), MESSAGES)] for name in ros.list()}
