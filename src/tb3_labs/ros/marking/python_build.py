"""Makes the Python modules of a submission's packages: messages, services, and those of a setup.py.

A Python node needs nothing else of a build. catkin is not asked: a CMakeLists.txt of a course's
repository often wants packages that no marking machine has, and it is a stranger's program.
"""
import os
import re
import shutil
import threading
from pathlib import Path

import genmsg
import rospkg
from genmsg.msg_loader import MsgNotFound
from genpy.generate_initpy import write_modules
from genpy.generator import MsgGenerator, SrvGenerator

from tb3_labs.ros.marking.repository import interface_files

GENERATORS = {'msg': MsgGenerator, 'srv': SrvGenerator}
RECIPE = 'CMakeLists.txt'
#: The CMake commands that name other packages.
ASKING = re.compile(r'\b(find_package|catkin_package|generate_messages)\s*\(([^)]*)\)', re.I)
LISTS = ('COMPONENTS', 'CATKIN_DEPENDS', 'DEPENDENCIES')
GENERATES = re.compile(r'\bgenerate_messages\s*\(', re.I)
#: genpy keeps its state in its module.
_GENPY = threading.Lock()


class Builder:
    """Builds packages, each with the messages of the earlier ones; `environment` has them all."""

    def __init__(self, folder, environment, remarks):
        """`folder`: for the modules; `environment`: of the node; `remarks`: a list that grows by
        sentences."""
        self._folder, self._remarks = Path(folder), remarks
        self.environment = dict(environment, PYTHONPATH=os.pathsep.join(
            [str(folder)] + [path for path in [environment.get('PYTHONPATH')] if path]))
        self._search = {}

    def build(self, name, package):
        """Make the modules of a package, whose folder is `package`."""
        target, interfaces = self._folder / name, interface_files(package)
        own = package / 'src' / name
        if (package / 'setup.py').exists() and own.is_dir():
            shutil.copytree(str(own), str(target))
        self._search[name] = [str(package / 'msg')]
        for kind, files in interfaces.items():
            if kind not in GENERATORS:
                self._remarks.append('{} has actions: they were not built.'.format(name))
                continue
            for file in files:
                self._generate(name, kind, package / kind / file, target / kind)
        if interfaces:
            self._tell_about(name, package / RECIPE)
            (target / '__init__.py').touch()

    def _generate(self, name, kind, file, target):
        generator = GENERATORS[kind]()
        search = dict(system_messages(), **self._search)
        try:
            with _GENPY:
                generator.generate(genmsg.MsgContext.create_default(),
                                   '{}/{}'.format(name, file.stem), str(file), str(target), search)
                write_modules(str(target))
        except (genmsg.InvalidMsgSpec, genmsg.MsgGenerationException, MsgNotFound, ValueError,
                KeyError) as problem:
            (target / '_{}.py'.format(file.stem)).unlink(missing_ok=True)
            said = ' '.join(str(problem).replace('{}: '.format(file), '').split())
            self._remarks.append('{}/{} cannot be built: {}.'.format(name, file.name,
                                                                     said.rstrip('.')))

    def _tell_about(self, name, recipe):
        """What a CMakeLists.txt would have done elsewhere."""
        text = recipe.read_text(encoding='utf-8', errors='replace') if recipe.is_file() else ''
        if not GENERATES.search(without_comments(text)):
            self._remarks.append('{} does not generate its messages ({}): they were built all the '
                                 'same.'.format(name, 'generate_messages() is missing' if text
                                                else 'it has no ' + RECIPE))
        lacking = sorted(set(asked_for(text)) - set(system_packages()) - set(self._search))
        if lacking:
            self._remarks.append('{} asks CMake for {}, which the marking machine lacks: left '
                                 'out.'.format(name, ' and '.join(lacking)))


def system_packages():
    """The names of all ROS packages of this machine."""
    with _LOOKING:
        return _ROS.list()


def system_messages():
    """name -> folders of its messages, of all ROS packages of this machine."""
    with _LOOKING:
        if not _MESSAGES:
            for name in _ROS.list():
                folder = os.path.join(_ROS.get_path(name), 'msg')
                if os.path.isdir(folder):
                    _MESSAGES[name] = [folder]
    return _MESSAGES


_ROS, _MESSAGES = rospkg.RosPack(), {}
#: Several submissions are prepared at a time; none shall see half of the packages.
_LOOKING = threading.Lock()


def without_comments(recipe):
    """The text of a CMakeLists.txt without its comments."""
    return re.sub(r'#.*', '', recipe)


def asked_for(recipe):
    """The names of the packages that a CMakeLists.txt asks catkin for."""
    for command, inside in ASKING.findall(without_comments(recipe)):
        words = inside.split()
        if command.lower() == 'find_package' and words[:1] != ['catkin']:
            continue
        listing = False
        for word in words:
            if word.isupper() or '$' in word:
                listing = word in LISTS
            elif listing:
                yield word
