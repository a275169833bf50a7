"""Makes the Python modules of a submission's packages: messages, services, and those of a setup.py.

A Python node needs nothing else of a build. catkin is not asked: a CMakeLists.txt of a course's
repository often wants packages that no marking machine has, and it is a stranger's program.
"""
import json
import os
import re
import shutil
import subprocess
import tempfile
from functools import lru_cache
from pathlib import Path

import rospkg

from tb3_labs.marking.foreign import is_name, printable
from tb3_labs.ros.marking import types_in_box
from tb3_labs.ros.marking.repository import interface_files

#: Kinds of files from which modules are made.
BUILT = ('msg', 'srv')
MODULE = re.compile(r'_[A-Za-z0-9_]+\.py')
RECIPE = 'CMakeLists.txt'
#: The CMake commands that name other packages.
ASKING = re.compile(r'\b(find_package|catkin_package|generate_messages)\s*\(([^)]*)\)', re.I)
LISTS = ('COMPONENTS', 'CATKIN_DEPENDS', 'DEPENDENCIES')
GENERATES = re.compile(r'\bgenerate_messages\s*\(', re.I)
#: All messages of a submission are built within this time [s].
BUILD_TIME = 30.0


class Builder:
    """Builds packages, each with the messages of all; `environment` has them."""

    def __init__(self, folder, environment, remarks, box):
        """`folder`: for the modules; `environment`: of the node; `remarks`: a list that grows by
        sentences; `box`: a Box, in which the messages are read."""
        self._folder, self._remarks, self._box = Path(folder), remarks, box
        self._without = environment
        self.environment = dict(environment, PYTHONPATH=os.pathsep.join(
            [str(folder)] + [path for path in [environment.get('PYTHONPATH')] if path]))

    def build(self, packages):
        """Make the modules of packages, name -> folder; what types_in_box says of their types."""
        files = []
        for name, package in packages.items():
            own = package / 'src' / name
            if (package / 'setup.py').exists() and own.is_dir():
                shutil.copytree(str(own), str(self._folder / name))
            files += self._definitions(name, package)
        if not files:
            return None
        done = self._run({'search': system_messages(), 'definitions': files})
        for package, kind, name, text in done['modules']:
            if not (package in packages and kind in BUILT and MODULE.fullmatch(name)):
                raise ValueError('a module is called {!r}'.format([package, kind, name]))
            place = self._folder / package / kind
            place.mkdir(parents=True, exist_ok=True)
            (place / name).write_text(text, encoding='utf-8')
            (self._folder / package / '__init__.py').touch()
        for name, problem in sorted(done['problems'].items()):
            self._remarks.append('{} cannot be built: {}.'.format(
                name, ' '.join(problem.split()).rstrip('.')))
        for name, package in packages.items():
            if interface_files(package):
                self._tell_about(name, set(packages), package / RECIPE)
        return done

    def _definitions(self, name, package):
        """(package, kind, name, text) of each message and service that ROS allows."""
        for kind, files in interface_files(package).items():
            if kind not in BUILT:
                self._remarks.append('{} has actions: they were not built.'.format(name))
                continue
            for file in files:
                stem = file[:-len(kind) - 1]
                if is_name(stem):
                    text = (package / kind / file).read_text(encoding='utf-8', errors='replace')
                    yield name, kind, stem, text
                else:
                    self._remarks.append('{}/{} was not built: ROS allows letters, digits and _ in '
                                         'the name of a type.'.format(name, printable(file)))

    def _run(self, request):
        """The answer of types_in_box, by a file: a program in a box cannot write a large one."""
        command = ['python3', '-c', Path(types_in_box.__file__).read_text()]
        with tempfile.TemporaryFile('w+') as asked, tempfile.TemporaryFile('w+') as answer:
            json.dump(request, asked)
            asked.seek(0)
            try:
                subprocess.run(self._box.world(self._box.command(command)), stdin=asked,
                               stdout=answer, stderr=subprocess.DEVNULL, timeout=BUILD_TIME,
                               env=self._box.environment(self._without), check=True)
                answer.seek(0)
                return json.load(answer)
            except (subprocess.SubprocessError, ValueError):
                self._remarks.append('The messages and services could not be built.')
                return {'modules': [], 'problems': {}, 'fields': {}, 'sums': {}}

    def _tell_about(self, name, own, recipe):
        """What a CMakeLists.txt would have done elsewhere; `own`: packages of the submission."""
        text = recipe.read_text(encoding='utf-8', errors='replace') if recipe.is_file() else ''
        if not GENERATES.search(without_comments(text)):
            self._remarks.append('{} does not generate its messages ({}): they were built all the '
                                 'same.'.format(name, 'generate_messages() is missing' if text
                                                else 'it has no ' + RECIPE))
        lacking = sorted(set(asked_for(text)) - set(system_packages()) - own)
        if lacking:
            self._remarks.append('{} asks CMake for {}, which the marking machine lacks: left '
                                 'out.'.format(name, ' and '.join(lacking)))


@lru_cache(maxsize=None)
def system_packages():
    """name -> folder of each ROS package of this machine; the same mapping at each call."""
    # A RosPack fills itself while it is asked: one for each thread that comes first.
    ros = rospkg.RosPack()
    return {name: ros.get_path(name) for name in ros.list()}


@lru_cache(maxsize=None)
def system_messages():
    """name -> folders of its messages, of all ROS packages of this machine."""
    folders = {name: os.path.join(folder, 'msg') for name, folder in system_packages().items()}
    return {name: [folder] for name, folder in folders.items() if os.path.isdir(folder)}


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
