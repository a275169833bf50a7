"""Makes the Python modules of a submission's packages: messages, services, and those of a setup.py.

A Python node needs nothing else of a build. catkin is not asked: a CMakeLists.txt of a course's
repository often needs packages that no marking machine has, and it is a program of the submission.
"""
import json
import os
import re
import shutil
import subprocess
import tempfile
from functools import lru_cache
from pathlib import Path
from typing import Any, Dict, List, Optional, Union

import rospkg

from tb3_labs.marking import messages_in_sandbox
from tb3_labs.marking.names import is_name, printable
from tb3_labs.marking.packages import interface_files
from tb3_labs.marking.sandbox import NoSandbox, Sandbox

#: Kinds of files from which modules are made.
MESSAGES, SERVICES = 'msg', 'srv'
MODULE = re.compile(r'_[A-Za-z0-9_]+\.py')
RECIPE = 'CMakeLists.txt'
#: All messages of a submission are built within this time [s].
BUILD_TIME = 30.0


def build(packages: Dict[str, Path], folder: Path, environment: Dict[str, str], remarks: List[str],
          sandbox: Union[Sandbox, NoSandbox]) -> Optional[Dict[str, Any]]:
    """Make the modules of packages, name -> folder, below `folder`; the description of their types,
    see messages_in_sandbox, None if they have none.

    `environment`: of the sandbox, in which the messages are read; `remarks` grows by sentences.
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
    for name, package in packages.items():
        if interface_files(package) and not _generates(package / RECIPE):
            remarks.append('{} does not generate its messages (generate_messages() is missing in '
                           '{}): they were built all the same.'.format(name, RECIPE))
    return done


def _generates(recipe):
    text = recipe.read_text(encoding='utf-8', errors='replace') if recipe.is_file() else ''
    return re.search(r'^[^#\n]*\bgenerate_messages\s*\(', text, re.IGNORECASE | re.MULTILINE)


def _definitions(name, package, remarks):
    for kind, files in interface_files(package).items():
        if kind not in (MESSAGES, SERVICES):
            remarks.append('{} has actions: they were not built.'.format(name))
            continue
        for file in files:
            stem = file[:-len(kind) - 1]
            if is_name(stem):
                text = (package / kind / file).read_text(encoding='utf-8', errors='replace')
                yield [name, kind, stem, text]
            else:
                remarks.append('{}/{} was not built: ROS allows letters, digits and _ in the name '
                               'of a type.'.format(name, printable(file)))


def _read(request, environment, sandbox):
    """The answer of messages_in_sandbox, None if there is none; by a file, since a program in a
    sandbox cannot write a large one."""
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
    """name -> folders of its messages, of all ROS packages of this machine; always the same."""
    # A RosPack fills itself while it is asked: one for each thread that comes first.
    ros = rospkg.RosPack()
    folders = {name: os.path.join(ros.get_path(name), MESSAGES) for name in ros.list()}
    return {name: [folder] for name, folder in folders.items() if os.path.isdir(folder)}
