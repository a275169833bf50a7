"""The messages and services of a submission: which a node needs, made as modules and described.

genpy pastes names into Python code, and genmsg of Noetic evaluates constants, so neither reads a
file of a submission outside of a sandbox: :func:`describe` runs there, as a text.
"""
import inspect
import json
import os
import re
import resource
import shutil
import subprocess
import tempfile
from functools import lru_cache
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional

import genmsg
import rospkg
from genmsg.msg_loader import load_msg_from_file, load_srv_from_file
from genpy.generate_initpy import write_modules
from genpy.generator import MsgGenerator, SrvGenerator

from tb3_labs.command_line import printable
from tb3_labs.marking.intake.packages import ACTIONS, MESSAGES, SERVICES, interface_files, is_name
from tb3_labs.marking.intake.sandbox import NoSandbox

MODULE = re.compile(r'_[A-Za-z0-9_]+\.py')
#: All messages of a submission are built within this time [s].
BUILD_TIME = 30.0
#: The most that `describe` may use: memory [bytes], processor time [s].
LIMITS = {resource.RLIMIT_AS: 10 ** 9, resource.RLIMIT_CPU: 20}
GENERATORS = {'msg': MsgGenerator, 'srv': SrvGenerator}
LOADERS = {'msg': load_msg_from_file, 'srv': load_srv_from_file}


def build(packages: Dict[str, Path], folder: Path, environment: Dict[str, str], remarks: List[str],
          sandbox: NoSandbox) -> Optional[Dict[str, Any]]:
    """Make the Python modules of `packages`, {name: folder}, below `folder`. Returns the
    description of their types, see describe; None if they define none.

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
    """Returns the answer of `describe`, in a sandbox; None if there is none.

    The answer comes in a file, since a program in a sandbox cannot write a large file.
    """
    command = ['python3', '-c', PROGRAM]
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


# -- in the sandbox

def describe(search, definitions):
    """Make modules of definitions, in the present folder. Returns an object for JSON.

    `search`: the system's packages and the folders of their messages. `definitions`: package, 'msg'
    or 'srv', name, text of each. The object has "modules" (package, 'msg' or 'srv', name of the
    file, text), "problems" (file -> why it cannot be built), "fields" (type -> type and name of
    each), and "sums" (type -> checksum, of messages and services).
    """
    problems = {}
    fields, sums = {}, {}
    for package, kind, name, text in definitions:
        os.makedirs(os.path.join('in', package, kind), exist_ok=True)
        search[package] = [os.path.join('in', package, 'msg')]
        with open(_path_of(package, kind, name), 'w', encoding='utf-8') as file:
            file.write(text)
    for package, kind, name, _ in definitions:
        target, full_name = os.path.join('out', package, kind), '{}/{}'.format(package, name)
        path = _path_of(package, kind, name)
        try:
            GENERATORS[kind]().generate(genmsg.MsgContext.create_default(), full_name, path,
                                        target, search)
            write_modules(target)
            described = _describe(path, kind, full_name, search)
        except Exception as problem:    # any error: the other files may be valid
            said = str(problem).replace(path + ': ', '') or repr(problem)
            problems['{}.{}'.format(full_name, kind)] = said
            if os.path.exists(os.path.join(target, '_{}.py'.format(name))):
                os.remove(os.path.join(target, '_{}.py'.format(name)))
                write_modules(target)
        else:
            fields.update(described[0])
            sums[full_name] = described[1]
    return {'problems': problems, 'fields': fields, 'sums': sums, 'modules': _modules()}


def _path_of(package, kind, name):
    return os.path.join('in', package, kind, '{}.{}'.format(name, kind))


def _describe(path, kind, full_name, search):
    """Returns the fields of a type and of all types in it, and the checksum of the type."""
    context, fields = genmsg.MsgContext.create_default(), {}
    spec = LOADERS[kind](context, path, full_name)
    genmsg.load_depends(context, spec, search)
    waiting = [spec] if kind == 'msg' else [spec.request, spec.response]
    while waiting:
        one = waiting.pop()
        fields[one.full_name] = list(zip(one.types, one.names))
        waiting += [context.get_registered(field.base_type) for field in one.parsed_fields()
                    if (field.is_header or not field.is_builtin) and field.base_type not in fields]
    return fields, genmsg.compute_md5(context, spec)


def _modules():
    found = []
    for folder, _, names in os.walk('out'):
        for name in names:
            with open(os.path.join(folder, name), encoding='utf-8') as file:
                found.append(folder.split(os.sep)[1:] + [name, file.read()])
    return found


PARTS: List[Callable[..., Any]] = [describe, _path_of, _describe, _modules]
#: The text of the program in the sandbox: it reads the arguments of `describe` from its input.
PROGRAM = '''import json, os, resource, sys, tempfile
import genmsg
from genmsg.msg_loader import load_msg_from_file, load_srv_from_file
from genpy.generate_initpy import write_modules
from genpy.generator import MsgGenerator, SrvGenerator
GENERATORS = {{'msg': MsgGenerator, 'srv': SrvGenerator}}
LOADERS = {{'msg': load_msg_from_file, 'srv': load_srv_from_file}}
{}
for limit, most in {}.items():
    resource.setrlimit(limit, (most, most))
with tempfile.TemporaryDirectory() as here:
    os.chdir(here)
    json.dump(describe(**json.load(sys.stdin)), sys.stdout)
'''.format('\n'.join(inspect.getsource(part) for part in PARTS), {
    int(limit): most for limit, most in LIMITS.items()})
