"""Finds the packages of a submission, with their names, folders, messages and modules.

All files are only read. CMake is not run.
"""
import os
import re
import shutil
import xml.etree.ElementTree as ElementTree
from contextlib import suppress
from pathlib import Path
from typing import Dict, List, Optional, Tuple

from tb3_labs.marking.intake.archives import files_in
from tb3_labs.marking.names import NAME, is_name

MANIFEST = 'package.xml'
#: At most this much of a package.xml or a CMakeLists.txt is read [bytes].
MAX_MANIFEST_BYTES = 100000
#: The folders of a package's messages, services and actions, and the endings of these files.
INTERFACES = MESSAGES, SERVICES, ACTIONS = 'msg', 'srv', 'action'
#: The folders of a package where nodes usually are, likeliest first.
FOLDERS = ('scripts', 'nodes', 'src')
#: A file was put aside if a part of its path is hidden, or has one of these words in its name.
ASIDE = re.compile(r'^\.|(?<![a-z])(backups?|bak|copy|copies|kopie|old|orig|trash|papierkorb|'
                   r'archived?|deleted)(?![a-z])', re.IGNORECASE)
#: A comment of CMake. It ends at its closing bracket, or at the end of the line.
CMAKE_COMMENT = re.compile(r'#\[(=*)\[.*?(?:\]\1\]|\Z)|#[^\n]*', re.DOTALL)


def package_folder(path: Path, folder: Path) -> Optional[Path]:
    """Returns the nearest folder above `path` that has a package.xml. Returns None if no folder up
    to `folder` has a package.xml."""
    for parent in path.parents:
        if (parent / MANIFEST).is_file():
            return parent
        if parent == folder:
            return None
    return None


def name_in(manifest: Path) -> Tuple[str, str]:
    """Returns (the name in a package.xml, ''), or ('', a sentence) if there is no valid name."""
    if not manifest.is_file():
        return '', 'The package has no package.xml.'
    try:
        text = manifest.read_bytes()[:MAX_MANIFEST_BYTES].decode('utf-8-sig', errors='replace')
        if '<!ENTITY' in text:      # an entity may expand to millions of entities
            raise ValueError('it has entities')
        name = (ElementTree.fromstring(text).findtext('name') or '').strip()
    except (ElementTree.ParseError, ValueError, LookupError, RecursionError) as error:
        return '', f'package.xml cannot be read ({error}).'
    if NAME.fullmatch(name.replace('-', '_')):
        return name, ''
    return '', f'The package is called {name[:60]!r}, which is not a name for ROS.'


def distance(path: Path, node: Path, folder: Path) -> Tuple[int, bool, int, str]:
    """Returns a key that sorts paths in `folder`, the nearest to `node` first. Of two equally near
    paths, a path that was put aside comes last."""
    common = set(path.parents) & set(node.parents)
    return -len(common), is_aside(str(path.relative_to(folder))), len(path.parts), str(path)


def packages_in(folder: Path, node: Path) -> Dict[str, Path]:
    """Returns name -> folder of the packages below `folder` whose names a program can import.

    A package has a package.xml, or at least message files. If packages have the same name, the one
    nearest to `node` is returned. A package without a name gets the name of its folder.
    """
    files = files_in(folder)
    found = {path.parent for path in files if path.name == MANIFEST}
    found |= {path.parent.parent for path in files
              if path.parent.name in INTERFACES and path.suffix == '.' + path.parent.name}
    packages = {}
    # the nearest package comes last, and replaces packages with the same name
    for package in sorted(found, key=lambda path: distance(path, node, folder), reverse=True):
        name = own_name(package) or re.sub(r'\W|^(?=\d)', '_', package.name)
        if is_name(name):
            packages[name] = package
    return packages


def own_name(package: Path) -> str:
    """Returns the name in package.xml, or else the name in CMakeLists.txt, or else ''."""
    names = [name_in(package / MANIFEST)[0], *calls_of('project', package)]
    return next((name.split()[0] for name in names if name.strip()), '')


def gather_definitions(folder: Path) -> None:
    """Copy each message and service below `folder` into the usual folder of its package. Without a
    package the usual folder is made beside the file."""
    for path in files_in(folder):
        kind = path.suffix[1:]
        is_definition = kind in (MESSAGES, SERVICES) and is_name(path.stem)
        is_misplaced = is_definition and path.parent.name != kind
        is_unused = is_aside(str(path.relative_to(folder)))
        if is_misplaced and not is_unused and path.stat().st_size <= MAX_MANIFEST_BYTES:
            package = package_folder(path, folder) or path.parent
            with suppress(OSError):
                (package / kind).mkdir(exist_ok=True)
                if not (package / kind / path.name).exists():
                    shutil.copy(str(path), str(package / kind))


def interface_files(package: Path) -> Dict[str, List[str]]:
    """Returns kind -> names of a package's files. The names may be invalid."""
    return {kind: sorted(path.name for path in (package / kind).glob('*.' + kind) if path.is_file())
            for kind in INTERFACES}


def is_aside(path: str) -> bool:
    """Does a part of the path begin with a dot, or contain a word such as old or copy?"""
    return any(map(ASIDE.search, Path(path).parts))


def source_of(node: Path, folder: Path) -> Path:
    """Returns the folder of a node's package. Without a package.xml the folder is guessed."""
    found = package_folder(node, folder)
    if found is not None:
        return found
    in_usual = node.parent.name in FOLDERS and node.parent != folder
    return node.parent.parent if in_usual else node.parent


def calls_of(command: str, package: Path) -> List[str]:
    """Returns the arguments of each call of a command in the CMakeLists.txt of a package."""
    file = package / 'CMakeLists.txt'
    text = file.read_bytes()[:MAX_MANIFEST_BYTES].decode(errors='replace') if file.is_file() else ''
    text = CMAKE_COMMENT.sub('', text).replace('"', ' ')
    parts = re.split(re.escape(command), text, flags=re.IGNORECASE)[1:]
    return [part.partition(')')[0].lstrip(' (') for part in parts]


def modules_of(package: Path, name: str) -> List[Path]:
    """Returns the folders of modules that a package's setup.py installs. `name` is the package's
    name."""
    setup = package / 'setup.py'
    if not setup.is_file():
        return []
    text = setup.read_bytes()[:MAX_MANIFEST_BYTES].decode(errors='replace')
    names = {name, *re.findall(r'[\'"](\w+(?:/\w+)*)', text)}
    found = []
    for parent in sorted({'src', *names, *map(os.path.dirname, names)}):
        for folder in sorted((package / parent).glob('*')):
            is_named = folder.name in names or 'find_packages' in text
            if folder.is_dir() and is_named and (parent or (folder / '__init__.py').is_file()):
                found.append(folder)
    return found
