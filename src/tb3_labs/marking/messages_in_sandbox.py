"""Reads a submission's messages and services in a sandbox, makes and describes their modules.

genpy pastes names into Python code, and genmsg of Noetic evaluates constants, so neither reads a
file of a submission outside of a sandbox. ``python3 -c`` runs the text of this file there, so it
imports nothing of this package.

Reads a JSON object: "search" (for the system's packages: package -> folders of its messages) and
"definitions" (a list of package, "msg" or "srv", name, text). Writes one: "modules" (a list of
package, "msg" or "srv", name of the file, text), "problems" (file -> why it cannot be built),
"fields" (type -> a list of type and name), and "sums" (type -> checksum, of messages and services).
"""
import json
import os
import resource
import sys
import tempfile
from typing import Any, Dict, List

import genmsg
from genmsg.msg_loader import load_msg_from_file, load_srv_from_file
from genpy.generate_initpy import write_modules
from genpy.generator import MsgGenerator, SrvGenerator

#: The most that this program may use: memory [bytes], processor time [s].
LIMITS = {resource.RLIMIT_AS: 10 ** 9, resource.RLIMIT_CPU: 20}
GENERATORS = {'msg': MsgGenerator, 'srv': SrvGenerator}
LOADERS = {'msg': load_msg_from_file, 'srv': load_srv_from_file}


def main(search: Dict[str, List[str]], definitions: List[List[str]]) -> Dict[str, Any]:
    """Returns the object that is written. Files are made in the present folder."""
    problems: Dict[str, str] = {}
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


if __name__ == '__main__':
    for limit, most in LIMITS.items():
        resource.setrlimit(limit, (most, most))
    with tempfile.TemporaryDirectory() as here:
        os.chdir(here)
        json.dump(main(**json.load(sys.stdin)), sys.stdout)
