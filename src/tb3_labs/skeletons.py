"""The catkin package that a student begins a lab with.

The folder doc/skeletons/LAB holds the package's files as templates. In each of them the text
@PACKAGE@ stands for the package's name. If the name of a template ends in `.in`, the file is
written without this ending. With its plain name ROS's tools would find the template itself as a
package or a launch file.
"""
import keyword
import re
import shutil
import sys
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Dict, Sequence

from tb3_labs.command_line import write_output

#: The folder of this package that has a folder of templates for each lab.
FOLDER = 'doc/skeletons'
PLACEHOLDER = '@PACKAGE@'
SUFFIX = '.in'
MANIFEST = 'package.xml'
#: A package's name, as catkin wants it.
PACKAGE_NAME = re.compile(r'[a-z][a-z0-9_]*')
PROGRAM_MARK = '#!'
LEFTOVER = re.compile(r'(^|/)(\.|__pycache__/)|~$')


def checked_name(name: str, taken: Sequence[str]) -> str:
    """Returns `name`, the name of a package; ``ValueError`` if it is not valid.

    `taken`: names of Python modules that a package of this name would hide, or be hidden by.
    """
    if not PACKAGE_NAME.fullmatch(name):
        raise ValueError('{!r} is not a name for a package: it takes lower-case letters, digits '
                         'and underscores, a letter first, such as lab2'.format(name))
    # the places of Python and of what is installed, not the places of workspaces
    places = [path for path in sys.path if path.startswith((sys.prefix, sys.base_prefix))]
    if (name in (*taken, *sys.builtin_module_names) or keyword.iskeyword(name)
            or PathFinder.find_spec(name, places)):
        raise ValueError('the package cannot be called {}: Python would import something else by '
                         'that name'.format(name))
    return name


def skeleton(templates: Path, package: str) -> Dict[str, str]:
    """Returns {path in the package: text} of all files of a package with this name.

    `templates`: the folder doc/skeletons/LAB. Files that an editor or Python left are skipped.
    Raises ``OSError`` if a template cannot be read, ``ValueError`` if there is no such skeleton.
    """
    files = {}
    for path in sorted(templates.rglob('*')):
        name = path.relative_to(templates).as_posix()
        if path.is_file() and not LEFTOVER.search(name):
            name = name[:-len(SUFFIX)] if name.endswith(SUFFIX) else name
            files[name] = path.read_text(encoding='utf-8').replace(PLACEHOLDER, package)
    if MANIFEST not in files:
        raise ValueError('{} has no skeleton: {} is missing'.format(templates, MANIFEST + SUFFIX))
    return files


def checked_place(folder: Path) -> Path:
    """Returns `folder` if catkin finds packages in it; else ``ValueError``."""
    if not folder.is_dir():
        raise ValueError('there is no folder {}: make it first, such as mkdir -p ~/catkin_ws/src'
                         .format(folder))
    if (folder / 'src').is_dir():
        raise ValueError('{0} has a folder src, in which catkin looks for packages: give {0}/src'
                         .format(folder))
    for above in (folder, *folder.parents):
        if (above / MANIFEST).exists():
            raise ValueError('{} is within the package {}, where catkin looks for no other package'
                             .format(folder, above))
        if above.name == 'src' and not (above.parent / MANIFEST).exists():
            break    # a workspace: catkin searches only below it
    return folder


def write(files: Dict[str, str], target: Path) -> None:
    """Write a package into the new folder `target`; programs become executable.

    Raises ``FileExistsError`` if `target` exists. Raises ``OSError`` if it cannot be written; then
    `target` is removed again.
    """
    target.mkdir()
    try:
        for name, text in files.items():
            path = target / name
            path.parent.mkdir(parents=True, exist_ok=True)
            write_output(path, text)
            if text.startswith(PROGRAM_MARK):
                mode = path.stat().st_mode
                path.chmod(mode | (mode & 0o444) >> 2)    # users who may read it may start it
    except OSError:
        shutil.rmtree(str(target), ignore_errors=True)
        raise
