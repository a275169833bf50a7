"""The files that a build by catkin makes: the relay of a node, and the modules of a setup.py.

CMake is not run. Only the few lines that decide this are read.
"""
import fnmatch
import os
import re
from pathlib import Path
from typing import List

from tb3_labs.marking.intake.find_node import LARGEST_MANIFEST

#: catkin's relay: it starts a node's file from another folder, by this Python.
RELAY = '''#!{}
python_script = {!r}
with open(python_script, 'r') as fh:
    context = {{'__builtins__': __builtins__, '__doc__': None, '__file__': python_script,
               '__name__': __name__, '__package__': None}}
    exec(compile(fh.read(), python_script, 'exec'), context)
'''
#: catkin's relay of a folder of modules: its parent comes first on the path from then on.
RELAYED_MODULE = '''import os
import pkgutil
import sys
sys.path.insert(0, {0!r})
__path__ = pkgutil.extend_path(__path__, __name__)
if os.path.isfile({1!r}):
    with open({1!r}) as fh:
        exec(fh.read())
'''
#: CMake's command that makes relays; its variables, and those for the folder of a package.
RELAYS = 'catkin_install_python'
SET_BY_CMAKE = re.compile(r'\$\{[^${}]*\}')
#: A comment of CMake: in brackets, or up to the end of the line.
COMMENT = re.compile(r'#\[(=*)\[.*?(?:\]\1\]|\Z)|#[^\n]*', re.DOTALL)
SOURCE_FOLDER = re.compile(r'^\$\{(CMAKE_CURRENT|PROJECT)_SOURCE_DIR\}/')


def has_relay(source: Path, node: Path) -> bool:
    """Does the CMakeLists.txt of a package, in `source`, give a relay to its node?"""
    named = [place for call in _calls(source, RELAYS) if 'GLOBAL' not in call
             for place in _places(call.partition('DESTINATION')[0])[1:]]
    if '*' in named:        # a list of files, of which another line may name this one
        named += [place for call in _calls(source, '(') for place in _places(call)]
    return any(place != '*' and fnmatch.fnmatchcase(node.relative_to(source).as_posix(), place)
               for place in named)


def _calls(source, command):
    """The arguments of each call of a command in the CMakeLists.txt of a package."""
    file = source / 'CMakeLists.txt'
    text = file.read_bytes()[:LARGEST_MANIFEST].decode(errors='replace') if file.is_file() else ''
    text = COMMENT.sub('', text).replace('"', ' ')
    return [part.partition(')')[0].lstrip(' (') for part in re.split(re.escape(
        command), text, flags=re.IGNORECASE)[1:]]


def _places(words):
    """Words of CMake as places in a package; `*` stands for a variable."""
    return [os.path.normpath(SET_BY_CMAKE.sub('*', SOURCE_FOLDER.sub('', word)))
            for word in words.split()]


def modules_of(package: Path, name: str) -> List[Path]:
    """The folders that the setup.py of a package called `name` makes modules of."""
    setup = package / 'setup.py'
    if not setup.is_file() or (package / 'CMakeLists.txt').is_file() and not _calls(
            package, 'catkin_python_setup'):
        return []
    text = setup.read_bytes()[:LARGEST_MANIFEST].decode(errors='replace')
    words = {name, *re.findall(r'[\'"](\w+(?:/\w+)*)', text)}
    return [folder for place in sorted({'src', *words, *map(os.path.dirname, words)})
            for folder in sorted((package / place).glob('*')) if folder.is_dir() and (
                folder.name in words or 'find_packages' in text) and (
                    place or (folder / '__init__.py').is_file())]
