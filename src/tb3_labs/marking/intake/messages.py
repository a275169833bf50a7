"""The messages and services of a submission: made as modules, and described, in a sandbox alone.

See describe.py, which runs there.
"""
import json
import os
import re
import shutil
import subprocess
import tempfile
from functools import lru_cache
from pathlib import Path
from typing import Any, Dict, List, Optional

import rospkg

from tb3_labs.command_line import printable
from tb3_labs.marking.intake.packages import (
    ACTIONS, MESSAGES, SERVICES, interface_files, is_name)
from tb3_labs.marking.intake.sandbox import NoSandbox

MODULE = re.compile(r'_[A-Za-z0-9_]+\.py')
#: All messages of a submission are built within this time [s].
BUILD_TIME = 30.0
#: The text of the program in the sandbox.
PROGRAM = Path(__file__).with_name('describe.py').read_text(encoding='utf-8')


def build(packages: Dict[str, Path], folder: Path, environment: Dict[str, str], remarks: List[str],
          sandbox: NoSandbox) -> Optional[Dict[str, Any]]:
    """Make the Python modules of `packages`, {name: folder}, below `folder`. Returns the
    examples of their types, see describe.py; None if they define none.

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
        done = {'modules': [], 'problems': {}, 'msg': {}, 'srv': {}}
    for package_name, kind, name, text in done['modules']:
        if not (package_name in packages and kind in (MESSAGES, SERVICES)
                and MODULE.fullmatch(name)):
            raise ValueError('a module is called {!r}'.format([package_name, kind, name]))
        place = folder / package_name / kind
        place.mkdir(parents=True, exist_ok=True)
        (place / name).write_text(text, encoding='utf-8')
        (folder / package_name / '__init__.py').touch()
    remarks += ['{} cannot be built: {}.'.format(
        '/'.join(name.split(os.sep)[::2]), ' '.join(problem.split()).rstrip('.'))
        for name, problem in sorted(done['problems'].items())]
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
    """Returns the answer of the program in the sandbox; None if there is none.

    It comes in a file, since a program in a sandbox cannot write a large file.
    """
    with tempfile.TemporaryFile('w+') as asked, tempfile.TemporaryFile('w+') as answer:
        json.dump(request, asked)
        asked.seek(0)
        try:
            subprocess.run(
                sandbox.own_network(sandbox.command(['python3', '-c', PROGRAM])), stdin=asked,
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
