#!/usr/bin/env python3
"""Writes the catkin package with which a student begins a lab.

The folder doc/skeletons/LAB contains the package's files as templates. In a template the text
@PACKAGE@ stands for the package's name. The ending `.in` hides a template from ROS's tools, which
would take it for a package or a launch file. The file in the package lacks this ending.
"""
import sys
from pathlib import Path

import rospkg

from tb3_labs.command_line import Parser, error_text
from tb3_labs.safe_output import run_tool

FOLDER = 'doc/skeletons'
PLACEHOLDER = '@PACKAGE@'
TEMPLATE_SUFFIX = '.in'
#: {lab: the package's name in the handouts}
PACKAGES = {'imu': 'ice6', 'turn': 'lab2', 'move2goal': 'lab7_tf', 'gamepad': 'lab4_gamepad'}


def package_files(templates, package):
    """Returns {path in the package: text} of all files of the new package `package`. `templates` is
    the folder doc/skeletons/LAB. Raises ``OSError`` if a template cannot be read."""
    files = {}
    for path in sorted(templates.rglob('*')):
        name = path.relative_to(templates).as_posix()
        if name.endswith(TEMPLATE_SUFFIX):
            name = name[:-len(TEMPLATE_SUFFIX)]
        if path.is_file():
            files[name] = path.read_text(encoding='utf-8').replace(PLACEHOLDER, package)
    return files


def write_package(files, target):
    """Write a package into the new folder `target`, and make its programs executable. Raises
    ``OSError`` if `target` cannot be written. Raises ``ValueError`` if `target` exists, or if
    catkin would not find the package."""
    if (target.parent / 'src').is_dir():
        raise ValueError(f'{target.parent} has a folder src, in which catkin looks for packages: '
                         f'give {target.parent}/src')
    if target.exists():
        raise ValueError(f'{target} exists already: rename it, and type the command again')
    target.mkdir()
    for name, text in files.items():
        path = target / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding='utf-8')
        if text.startswith('#!'):
            path.chmod(0o755)


def parse(argv):
    parser = Parser(
        prog='skeleton.py',
        description='Writes the catkin package with which a student begins a lab: a launch file, '
        "and the lab's node with its TODOs. It overwrites no package.",
        epilog='Example: rosrun tb3_labs skeleton.py turn ~/catkin_ws/src')
    parser.add_argument('lab', metavar='LAB', choices=list(PACKAGES), help=', '.join(PACKAGES))
    parser.add_argument('folder', metavar='DIRECTORY', type=Path,
                        help='the folder src of a catkin workspace')
    return parser.parse_args(argv)


def main(argv):
    """Write the package and print the next steps. Returns the exit status."""
    options = parse(argv)
    package = PACKAGES[options.lab]
    templates = Path(rospkg.RosPack().get_path('tb3_labs')) / FOLDER / options.lab
    try:
        target = options.folder.expanduser().resolve() / package
        write_package(package_files(templates, package), target)
    # expanduser() raises RuntimeError for an unknown user, such as ~nobody
    except (OSError, RuntimeError, ValueError) as error:
        print(f'skeleton.py: {error_text(error)}', file=sys.stderr)
        return 2
    print(f'{target} is written. The TODOs are in its folder src. Next: cd {target.parent.parent}; '
          f'catkin_make; source devel/setup.bash; roslaunch {package} {options.lab}.launch '
          'sim:=true')
    return 0


if __name__ == '__main__':
    run_tool(main)
