#!/usr/bin/env python3
"""Writes the catkin package with which a student begins a lab.

The folder doc/skeletons/LAB has the package's files as templates. In a template the text @PACKAGE@
stands for the package's name. The name of a template may end in `.in`, so that ROS's tools do not
use it as a package or a launch file. The file in the package has its name without `.in`.
"""
import sys
from pathlib import Path

import rospkg

from tb3_labs.command_line import Parser, failure_text
from tb3_labs.terminal import run_tool

#: Each folder in this folder has the templates of a lab.
FOLDER = 'doc/skeletons'
PLACEHOLDER = '@PACKAGE@'
SUFFIX = '.in'
#: lab -> the name of its package in the handouts
PACKAGES = {'imu': 'ice6', 'turn': 'lab2', 'move2goal': 'lab7_tf', 'gamepad': 'lab4_gamepad'}


def package_files(templates, package):
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


def checked_target(folder, package):
    """Returns the folder of a new `package` in `folder`, the folder src of a workspace.
    ``ValueError`` if catkin would not find the package there."""
    if not folder.is_dir():
        raise ValueError(f'there is no folder {folder}: make it first, such as mkdir -p '
                         '~/catkin_ws/src')
    if (folder / 'src').is_dir():
        raise ValueError(f'{folder} has a folder src, in which catkin looks for packages: give '
                         f'{folder}/src')
    return folder / package


def write_package(files, target):
    """Write a package into the new folder `target`. Programs become executable. ``OSError`` if the
    package cannot be written, such as ``FileExistsError`` if `target` exists."""
    target.mkdir()
    for name, text in files.items():
        path = target / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding='utf-8')
        if text.startswith('#!'):
            path.chmod(0o755)


def parse(argv):
    """Returns the command line's arguments."""
    parser = Parser(
        prog='skeleton.py',
        description='Writes the catkin package that a student begins a lab with: a launch file, '
        "and the lab's node with its TODOs. What is already there is not overwritten.",
        epilog='Example: rosrun tb3_labs skeleton.py turn ~/catkin_ws/src')
    parser.add_argument('lab', metavar='LAB', choices=list(PACKAGES), help=', '.join(PACKAGES))
    parser.add_argument('folder', metavar='DIRECTORY', type=Path,
                        help='the folder src of a catkin workspace')
    return parser.parse_args(argv)


def main(argv):
    """Write the package, and print the next steps. Returns the exit status."""
    options = parse(argv)
    package = PACKAGES[options.lab]
    templates = Path(rospkg.RosPack().get_path('tb3_labs')) / FOLDER / options.lab
    try:
        target = checked_target(options.folder.expanduser().resolve(), package)
        write_package(package_files(templates, package), target)
    except FileExistsError as problem:
        print(f'skeleton.py: {problem.filename} is already there, and stays as it is',
              file=sys.stderr)
        return 2
    except (OSError, RuntimeError, ValueError) as problem:      # RuntimeError: an unknown ~user
        print(f'skeleton.py: {failure_text(problem)}', file=sys.stderr)
        return 2
    print(f'{target} is written. The TODOs are in its folder src. Next: cd {target.parent.parent}; '
          f'catkin_make; source devel/setup.bash; roslaunch {package} {options.lab}.launch '
          'sim:=true')
    return 0


if __name__ == '__main__':
    run_tool(main)
