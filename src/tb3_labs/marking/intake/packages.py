"""The packages of a submission: their names, folders and messages, and the files that a build by
catkin makes for them: the relay of a node, and the modules of a setup.py.

All files are only read. CMake is not run.
"""
import fnmatch
import os
import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Dict, List, Optional, Tuple

from tb3_labs.marking.intake.archives import files_in
from tb3_labs.marking.names import NAME, is_name

MANIFEST = 'package.xml'
#: At most this much of a package.xml or a CMakeLists.txt is read [bytes].
LARGEST_MANIFEST = 100000
#: The folders of a package's messages, services and actions; also the endings of their files.
INTERFACES = MESSAGES, SERVICES, ACTIONS = 'msg', 'srv', 'action'
#: The folders of a package where nodes usually are, likeliest first.
FOLDERS = ('scripts', 'nodes', 'src')
#: A hidden folder, or a folder with one of these words in its name, has files that were put aside.
ASIDE = re.compile(r'^\.|(?<![a-z])(backups?|bak|copy|copies|kopie|old|orig|trash|papierkorb|'
                   r'archived?|deleted)(?![a-z])', re.IGNORECASE)
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


def package_folder(path: Path, folder: Path) -> Optional[Path]:
    """Returns the nearest folder above `path`, within `folder`, with a package.xml; else None."""
    for parent in path.parents:
        if (parent / MANIFEST).is_file():
            return parent
        if parent == folder:
            return None
    return None


def name_in(manifest: Path) -> Tuple[str, str]:
    """Returns (name in a package.xml, ''), or ('', reason) if there is no valid name."""
    if not manifest.is_file():
        return '', 'The package has no package.xml: one was made.'
    try:
        text = manifest.read_bytes()[:LARGEST_MANIFEST].decode('utf-8-sig', errors='replace')
        if '<!ENTITY' in text:      # an entity may expand to millions of others
            raise ValueError('it has entities')
        name = (ElementTree.fromstring(text).findtext('name') or '').strip()
    except (ElementTree.ParseError, ValueError, LookupError, RecursionError) as error:
        return '', f'package.xml cannot be read ({error}): one was made.'
    if NAME.fullmatch(name.replace('-', '_')):
        return name, ''
    return '', f'The package is called {name[:60]!r}: it got another name.'


def packages_in(folder: Path, node: Path) -> Dict[str, Path]:
    """Returns name -> folder of all packages below `folder` whose names a program can import.

    A package has a package.xml, or at least message files. If several packages have one name, the
    package nearest to `node` is taken.
    """
    files = files_in(folder)
    places = {path.parent for path in files if path.name == MANIFEST} | {
        path.parent.parent for path in files
        if path.parent.name in INTERFACES and path.suffix == '.' + path.parent.name}

    def near(place: Path) -> Tuple[int, bool, int, str]:
        common = set(place.parents) & set(node.parents)
        return (-len(common), is_aside(str(place.relative_to(folder))), len(place.parts),
                str(place))
    # the nearest comes last, and replaces the earlier ones
    named = [(name_in(place / MANIFEST)[0] or place.name, place)
             for place in sorted(places, key=near, reverse=True)]
    return {name: place for name, place in named if is_name(name)}


def interface_files(package: Path) -> Dict[str, List[str]]:
    """Returns kind -> names of the files of this kind, in a package; the names may be invalid."""
    return {kind: sorted(path.name for path in (package / kind).glob('*.' + kind) if path.is_file())
            for kind in INTERFACES}


def is_aside(path: str) -> bool:
    """Does a path lead through a folder of hidden, old or copied files?"""
    return any(map(ASIDE.search, Path(path).parts))


def source_of(node: Path, folder: Path) -> Path:
    """Returns the folder of a node's package; a guess if there is no package.xml."""
    found = package_folder(node, folder)
    if found is not None:
        return found
    in_usual = node.parent.name in FOLDERS and node.parent != folder
    return node.parent.parent if in_usual else node.parent


# -- what catkin makes

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
