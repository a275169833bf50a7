"""A student's submission as it was handed in: its node, and its packages. Nothing is changed."""
import os
import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

#: Folders and files that are not looked into, nor copied.
LEFT_OUT = ('.git', '.svn', 'build', 'devel', 'install', 'logs', '__pycache__', '*.bag', '*.zip')
#: The folders where nodes usually are, likeliest first.
FOLDERS = ('scripts', 'nodes', 'src')
MANIFEST = 'package.xml'


class Unusable(Exception):
    """A submission has nothing that could be run; the text is one sentence, the reason."""


def find_node(folder, names):
    """The path of the node below `folder`, a file with one of these names, and remarks.

    If there are several, one in a package, and in a folder where nodes usually are, is taken.
    """
    files = [path for path in files_in(folder) if path.suffix == '.py' or not path.suffix]
    for name in names:
        found = [path for path in files if path.name == name] or [
            path for path in files if path.name.lower() == name.lower()]
        if found:
            found.sort(key=lambda path: (package_folder(path, folder) is None, _rank(path),
                                         str(path)))
            remarks = [] if len(found) == 1 else ['{} files are called {}; judged was {}.'.format(
                len(found), name, found[0].relative_to(folder))]
            return found[0], remarks
    others = sorted(str(path.relative_to(folder)) for path in files if path.suffix == '.py')
    raise Unusable('There is no {}. {}'.format(
        ' or '.join(names), 'Python files that were found (--type NAME judges another one): '
        + ', '.join(others[:10]) if others else 'No Python file was found at all.'))


def files_in(folder):
    """The paths of all files below `folder`, in order; no links."""
    for root, folders, files in os.walk(str(folder)):
        folders[:] = sorted(name for name in folders if name not in LEFT_OUT)
        for name in sorted(files):
            path = Path(root) / name
            if path.is_file() and not path.is_symlink():
                yield path


def _rank(path):
    parent = path.parent.name
    return FOLDERS.index(parent) if parent in FOLDERS else len(FOLDERS)


def package_folder(path, folder):
    """The nearest folder above `path` that has a package.xml, within `folder`; None if none has."""
    for parent in path.parents:
        if (parent / MANIFEST).is_file():
            return parent
        if parent == folder:
            return None
    return None


def source_of(node, folder):
    """The folder to copy for a node: that of its package, or a guess without a package.xml."""
    found = package_folder(node, folder)
    if found is not None:
        return found
    in_usual = node.parent.name in FOLDERS and node.parent != folder
    return node.parent.parent if in_usual else node.parent


def name_in(manifest):
    """The name in a package.xml and '', or '' and the reason why there is none."""
    if not manifest.is_file():
        return '', 'The package has no package.xml: one was made.'
    try:
        name = (ElementTree.parse(str(manifest)).getroot().findtext('name') or '').strip()
    except ElementTree.ParseError as error:
        return '', 'package.xml cannot be read ({}): one was made.'.format(error)
    if re.match(r'^[A-Za-z][\w-]*$', name):
        return name, ''
    return '', 'The package is called {!r}: it got another name.'.format(name)
