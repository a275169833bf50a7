"""The packages of a submission: their names, their messages, and the Python modules made of them.

A Python node needs nothing else of a build: messages, services, and the modules of a setup.py.
catkin is not run. A CMakeLists.txt often needs packages that the marking machine does not have, and
it is a program of the submission. Outside of a sandbox all files are only read as texts.
"""
import json
import os
import re
import shutil
import subprocess
import tempfile
import xml.etree.ElementTree as ElementTree
from functools import lru_cache
from pathlib import Path
from typing import Any, Dict, List, Optional, Set, Tuple, Union

import rospkg

from tb3_labs.marking import messages_in_sandbox
from tb3_labs.marking.names import NAME, is_name, printable
from tb3_labs.marking.sandbox import NoSandbox, Sandbox

MANIFEST, RECIPE = 'package.xml', 'CMakeLists.txt'
#: At most this much of a package.xml is read [bytes].
LARGEST_MANIFEST = 1000000
#: The folders of a package's messages, services and actions; also the endings of their files.
MESSAGES, SERVICES = 'msg', 'srv'
INTERFACES = (MESSAGES, SERVICES, 'action')
#: A field of a type of another package, as in `geometry_msgs/Pose2D goal`.
FIELD = re.compile(r'^\s*([A-Za-z]\w*)/[A-Za-z]\w*(?:\[\d*\])?\s+\w', re.MULTILINE)
MODULE = re.compile(r'_[A-Za-z0-9_]+\.py')
#: All messages of a submission are built within this time [s].
BUILD_TIME = 30.0


# -- files and manifests

def files_in(folder: Path) -> List[Path]:
    """Returns the paths of all files below `folder`, in order, without links."""
    return sorted(path for path in folder.rglob('*') if path.is_file() and not path.is_symlink())


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
        return '', 'package.xml cannot be read ({}): one was made.'.format(error)
    if NAME.fullmatch(name.replace('-', '_')):
        return name, ''
    return '', 'The package is called {!r}: it got another name.'.format(name[:60])


def packages_in(folder: Path, node: Path) -> Dict[str, Path]:
    """Returns name -> folder of all packages below `folder`.

    A package has a package.xml, or at least message files. If several packages have one name, the
    package nearest to `node` is taken. A package is left out if a program cannot import its name.
    """
    found: Dict[str, Set[Path]] = {}
    for path in files_in(folder):
        if path.name == MANIFEST:
            name, place = name_in(path)[0] or path.parent.name, path.parent
        elif path.parent.name in INTERFACES and path.suffix == '.' + path.parent.name:
            place = path.parent.parent
            if (place / MANIFEST).exists():
                continue
            name = place.name
        else:
            continue
        if is_name(name):
            found.setdefault(name, set()).add(place)

    def far(place: Path) -> Tuple[int, int, str]:
        common = sum(1 for parent in place.parents if parent in node.parents)
        return -common, len(place.parts), str(place)
    return {name: min(places, key=far) for name, places in found.items()}


# -- messages

def interface_files(package: Path) -> Dict[str, List[str]]:
    """Returns kind ('msg', 'srv', 'action') -> names of the files of this kind, in a package.

    A kind without files is left out. The names may be invalid.
    """
    return {kind: sorted(path.name for path in (package / kind).glob('*.' + kind) if path.is_file())
            for kind in INTERFACES if any((package / kind).glob('*.' + kind))}


def types_used(package: Path) -> Set[str]:
    """Returns the packages whose types are fields of the messages in a package's folder."""
    texts = [(package / kind / name).read_text(encoding='utf-8', errors='replace')
             for kind, names in interface_files(package).items() for name in names]
    return set(FIELD.findall('\n'.join(texts)))


def build(packages: Dict[str, Path], folder: Path, environment: Dict[str, str], remarks: List[str],
          sandbox: Union[Sandbox, NoSandbox]) -> Optional[Dict[str, Any]]:
    """Make the Python modules of `packages`, {name: folder}, below `folder`. Returns the
    description of their types, see messages_in_sandbox; None if they define none.

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
    """Returns the answer of messages_in_sandbox; None if there is none.

    The answer comes in a file, since a program in a sandbox cannot write a large file.
    """
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
    """Returns name -> folders of its messages, for all ROS packages of this machine; cached."""
    # A RosPack changes while it is asked: each thread that comes first has its own.
    ros = rospkg.RosPack()
    folders = {name: os.path.join(ros.get_path(name), MESSAGES) for name in ros.list()}
    return {name: [folder] for name, folder in folders.items() if os.path.isdir(folder)}
