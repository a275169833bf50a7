"""Finds the packages of a submission, with their names, folders, messages and modules."""
import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Dict, List, Optional, Tuple

from tb3_labs.marking.intake.archives import files_in
from tb3_labs.marking.student_nodes import NAME_PATTERN, is_valid_name

MANIFEST = 'package.xml'
MAX_MANIFEST_BYTES = 10 ** 5        # the rest of a package.xml or a setup.py is not read
#: Folders of messages and services have these names, and the files have these endings.
MESSAGES = 'msg'
DEFINITION_KINDS = MESSAGES, 'srv'
#: The folders of a package where nodes usually are, likeliest first.
NODE_FOLDERS = ('scripts', 'nodes', 'src')
#: A file is old or a copy if a part of its path begins with a dot, or contains one of these words.
OLD_OR_COPY = re.compile(
    r'^\.|(?<![a-z])(backups?|bak|copy|copies|kopie|old|orig|trash|papierkorb|'
    r'archived?|deleted)(?![a-z])', re.IGNORECASE)
#: Matches a character that Python forbids in a name, and the place before a digit that comes first.
FORBIDDEN_IN_NAMES = re.compile(r'\W|^(?=\d)')


def package_folder(path: Path, folder: Path) -> Optional[Path]:
    """Returns the nearest folder above `path`, up to `folder`, that has a package.xml, or None."""
    folders = [parent for parent in path.parents if parent == folder or folder in parent.parents]
    return next((parent for parent in folders if (parent / MANIFEST).is_file()), None)


def node_package(node: Path, folder: Path) -> Path:
    """Returns the folder of a node's package. Without a package.xml the folder is guessed."""
    package = package_folder(node, folder)
    if package is not None:
        return package
    is_in_node_folder = node.parent.name in NODE_FOLDERS and node.parent != folder
    return node.parent.parent if is_in_node_folder else node.parent


def package_name(package: Path) -> str:
    """Returns the name in the package.xml of a package, or '' if there is no valid name."""
    try:
        manifest = (package / MANIFEST).read_bytes()[:MAX_MANIFEST_BYTES]
        text = manifest.decode('utf-8-sig', errors='replace')
        if '<!ENTITY' in text:      # an XML entity may expand to millions of entities
            return ''
        name = ElementTree.fromstring(text).findtext('name', '').strip()
    except (OSError, ElementTree.ParseError, ValueError, LookupError, RecursionError):
        return ''
    return name if NAME_PATTERN.fullmatch(name.replace('-', '_')) else ''


def is_old_or_copy(path: str) -> bool:
    """Returns True if a part of the path begins with a dot, or contains a word such as old."""
    return any(OLD_OR_COPY.search(part) for part in Path(path).parts)


def distance_key(path: Path, node: Path, folder: Path) -> Tuple[int, bool, int, str]:
    """Returns a key that sorts the paths in `folder` by their distance from `node`, the nearest
    first. If paths are equally near, old or copied files come last."""
    common_folders = set(path.parents) & set(node.parents)
    is_old = is_old_or_copy(str(path.relative_to(folder)))
    return -len(common_folders), is_old, len(path.parts), str(path)


def packages_in(folder: Path, node: Path) -> Dict[str, Path]:
    """Returns {name: folder} of the packages below `folder` whose names a program can import. A
    package contains a package.xml, or at least message files. If several packages have the same
    name, only the nearest to `node` is returned. A package without a name gets its folder's name.
    """
    folders = {path.parent for path in files_in(folder) if path.name == MANIFEST}
    folders |= {path.parent.parent for path in definition_files_below(folder)
                if path.parent.name == path.suffix.lstrip('.')}
    packages = {}
    # the nearest package comes last, and replaces packages with the same name
    for package in sorted(folders, key=lambda path: distance_key(path, node, folder), reverse=True):
        name = package_name(package) or FORBIDDEN_IN_NAMES.sub('_', package.name)
        if is_valid_name(name):
            packages[name] = package
    return packages


def definition_files_below(folder: Path) -> List[Path]:
    """Returns the files of messages and services below `folder`. Some names may be invalid."""
    return [path for path in files_in(folder) if path.suffix.lstrip('.') in DEFINITION_KINDS]


def definition_files(package: Path) -> List[Path]:
    """Returns the files of a package's messages and services. Some names may be invalid."""
    return [path for kind in DEFINITION_KINDS
            for path in sorted((package / kind).glob('*.' + kind)) if path.is_file()]


def module_folders(package: Path, name: str) -> List[Path]:
    """Returns the folders of modules that a package's setup.py may install, the deepest first.
    `name` is the package's name."""
    setup = package / 'setup.py'
    if not setup.is_file():
        return []
    text = setup.read_bytes()[:MAX_MANIFEST_BYTES].decode(errors='replace')
    folders = {path.parent for path in files_in(package) if path.suffix == '.py'} - {package}
    if 'find_packages' not in text:     # then the text contains the names of the folders
        folder_names = {name, *re.findall(r'\w+', text)}
        folders = {folder for folder in folders if folder.name in folder_names}
    return sorted(folders, key=lambda folder: len(folder.parts), reverse=True)
