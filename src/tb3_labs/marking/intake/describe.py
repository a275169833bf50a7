"""Makes modules of messages and services, and describes them: a program for a sandbox.

genpy pastes names into Python code, and genmsg of Noetic evaluates constants. The program gets an
object on its input: `search` has the system's packages and the folders of their messages;
`definitions` has package, 'msg' or 'srv', name and text of each. It prints an object: "modules"
(package, 'msg' or 'srv', name of the file, text), "problems" (file -> why it cannot be built),
"fields" (type -> type and name of each), "sums" (type -> checksum, of messages and services).
"""
import json
import os
import resource
import sys
import tempfile

import genmsg
from genmsg.msg_loader import load_msg_from_file, load_srv_from_file
from genpy.generate_initpy import write_modules
from genpy.generator import MsgGenerator, SrvGenerator

#: The most that the program may use: memory [bytes], processor time [s].
LIMITS = {resource.RLIMIT_AS: 10 ** 9, resource.RLIMIT_CPU: 20}
GENERATORS = {'msg': MsgGenerator, 'srv': SrvGenerator}
LOADERS = {'msg': load_msg_from_file, 'srv': load_srv_from_file}


def describe(search, definitions):
    """Make the modules in the present folder. Returns the object that is printed."""
    said = {'problems': {}, 'fields': {}, 'sums': {}, 'modules': []}
    paths = [os.path.join('in', package, kind, '{}.{}'.format(name, kind))
             for package, kind, name, _ in definitions]
    for path, (package, *_, text) in zip(paths, definitions):
        search[package] = [os.path.join('in', package, 'msg')]
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, 'w', encoding='utf-8') as file:
            file.write(text)
    for path, (package, kind, name, _) in zip(paths, definitions):
        full_name = '{}/{}'.format(package, name)
        target = os.path.join('out', package, kind)
        module = os.path.join(target, '_{}.py'.format(name))
        try:
            GENERATORS[kind]().generate(genmsg.MsgContext.create_default(), full_name, path,
                                        target, search)
            fields, said['sums'][full_name] = _describe(path, kind, full_name, search)
            said['fields'].update(fields)
        except Exception as problem:    # any error: the other files may be valid
            said['problems'][os.path.relpath(path, 'in')] = str(problem).replace(
                path + ': ', '') or repr(problem)
            if os.path.exists(module):
                os.remove(module)
        if os.path.isdir(target):
            write_modules(target)
    for folder, _, names in os.walk('out'):
        for name in names:
            with open(os.path.join(folder, name), encoding='utf-8') as file:
                said['modules'].append(folder.split(os.sep)[1:] + [name, file.read()])
    return said


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


if __name__ == '__main__':
    for limit, most in LIMITS.items():
        resource.setrlimit(limit, (most, most))
    with tempfile.TemporaryDirectory() as here:
        os.chdir(here)
        json.dump(describe(**json.load(sys.stdin)), sys.stdout)
