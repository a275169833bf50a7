"""Writes the catkin package with which a student begins a lab.

The folder doc/skeletons/LAB has the package's files as templates. In a template the text @PACKAGE@
stands for the package's name. The name of a template may end in `.in`, so that ROS's tools do not
use the template as a package or a launch file. The file in the package has its name without `.in`.
"""
from pathlib import Path
from typing import Dict

#: Each folder in this folder has the templates of a lab.
FOLDER = 'doc/skeletons'
PLACEHOLDER = '@PACKAGE@'
SUFFIX = '.in'


def package_files(templates: Path, package: str) -> Dict[str, str]:
    """Returns {path in the package: text} of all files of the package called `package`.

    `templates` is the folder doc/skeletons/LAB. Raises ``OSError`` if a template cannot be read.
    """
    files = {}
    for path in sorted(templates.rglob('*')):
        name = path.relative_to(templates).as_posix()
        if path.is_file():
            if name.endswith(SUFFIX):
                name = name[:-len(SUFFIX)]
            files[name] = path.read_text(encoding='utf-8').replace(PLACEHOLDER, package)
    return files


def checked_target(folder: Path, package: str) -> Path:
    """Returns the folder of a new `package` in `folder`, the folder src of a workspace.
    ``ValueError`` if catkin would not find the package there."""
    if not folder.is_dir():
        raise ValueError(f'there is no folder {folder}: make it first, such as mkdir -p '
                         '~/catkin_ws/src')
    if (folder / 'src').is_dir():
        raise ValueError(f'{folder} has a folder src, in which catkin looks for packages: give '
                         f'{folder}/src')
    return folder / package


def write_package(files: Dict[str, str], target: Path) -> None:
    """Write a package into the new folder `target`. Programs become executable. ``OSError`` if the
    package cannot be written, such as ``FileExistsError`` if `target` exists."""
    target.mkdir()
    for name, text in files.items():
        path = target / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding='utf-8')
        if text.startswith('#!'):
            path.chmod(path.stat().st_mode | 0o111)
