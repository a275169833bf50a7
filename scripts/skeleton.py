#!/usr/bin/env python3
"""Writes the catkin package that a student begins a lab with, from the texts in doc/skeletons."""
import sys
from pathlib import Path

import rospkg

from tb3_labs.command_line import Parser, failure_text
from tb3_labs.skeletons import FOLDER, checked_target, package_files, write_package
from tb3_labs.marking.names import LAB_NODES
from tb3_labs.terminal import run_tool


def parse(argv):
    """Returns the command line's arguments."""
    parser = Parser(
        prog='skeleton.py',
        description='Writes the catkin package that a student begins a lab with: a launch file, '
        "and the lab's node with its TODOs. What is already there is not overwritten.",
        epilog='Example: rosrun tb3_labs skeleton.py turn ~/catkin_ws/src')
    parser.add_argument('lab', metavar='LAB', choices=list(LAB_NODES), help=', '.join(LAB_NODES))
    parser.add_argument('folder', metavar='DIRECTORY', type=Path,
                        help='the folder src of a catkin workspace')
    return parser.parse_args(argv)


def main(argv):
    """Write the package, and print the next steps. Returns the exit status."""
    options = parse(argv)
    package = LAB_NODES[options.lab].packages[0]
    node = LAB_NODES[options.lab].files[0]
    templates = Path(rospkg.RosPack().get_path('tb3_labs')) / FOLDER / options.lab
    try:
        target = checked_target(options.folder.expanduser().resolve(), package)
        write_package(package_files(templates, package), target)
    except FileExistsError as problem:
        print(f'skeleton.py: {problem.filename} is already there, and stays as it is',
              file=sys.stderr)
        return 2
    except (OSError, RuntimeError, ValueError) as problem:      # RuntimeError: ~nobody has no home
        print(f'skeleton.py: {failure_text(problem)}', file=sys.stderr)
        return 2
    print(f'{target} is written. The TODOs are in src/{node}. Next: cd {target.parent.parent}; '
          f'catkin_make; source devel/setup.bash; roslaunch {package} {options.lab}.launch '
          'sim:=true')
    return 0


if __name__ == '__main__':
    run_tool(main)
