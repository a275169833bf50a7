"""A student's submission as it was handed in: its node, and its packages. Nothing is changed."""
import os
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from tb3_labs.marking.choice import FOLDERS, NoNode, SourceFile, choose
from tb3_labs.marking.foreign import NAME

#: Folders and files that are not looked into, nor copied.
LEFT_OUT = ('.git', '.svn', 'build', 'devel', 'install', 'logs', '__pycache__', '*.bag', '*.zip')
#: A larger file is no program [bytes].
LARGEST_PROGRAM = 1000000
MANIFEST = 'package.xml'


class Unusable(Exception):
    """A submission has nothing that could be run; the text is one sentence, the reason."""


def find_node(folder, lab, package='', name=''):
    """The path of a Lab's node below `folder`, and remarks on the choice.

    `package` and `name`, if given, are those of the node. ``Unusable`` if there is none.
    """
    try:
        choice = choose(lab, [
            SourceFile(str(path.relative_to(folder)), _package_name(path, folder), _text(path))
            for path in files_in(folder) if _is_program(path)], package, name)
    except NoNode as reason:
        raise Unusable(str(reason)) from None
    return folder / choice.path, choice.remarks


def _is_program(path):
    if path.stat().st_size > LARGEST_PROGRAM:
        return False
    return path.suffix == '.py' or not path.suffix and b'python' in path.read_bytes()[:80]


def _text(path):
    return path.read_bytes().decode(errors='replace')


def _package_name(path, folder):
    found = package_folder(path, folder)
    return name_in(found / MANIFEST)[0] if found else ''


def files_in(folder):
    """The paths of all files below `folder`, in order; no links."""
    for root, folders, files in os.walk(str(folder)):
        folders[:] = sorted(name for name in folders if name not in LEFT_OUT)
        for name in sorted(files):
            path = Path(root) / name
            if path.is_file() and not path.is_symlink():
                yield path


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
        text = manifest.read_bytes()[:LARGEST_PROGRAM].decode('utf-8-sig', errors='replace')
        if '<!ENTITY' in text:      # it may stand for millions of others
            raise ValueError('it has entities')
        name = (ElementTree.fromstring(text).findtext('name') or '').strip()
    except (ElementTree.ParseError, ValueError, LookupError, RecursionError) as error:
        return '', 'package.xml cannot be read ({}): one was made.'.format(error)
    if NAME.fullmatch(name.replace('-', '_')):
        return name, ''
    return '', 'The package is called {!r}: it got another name.'.format(name[:60])
