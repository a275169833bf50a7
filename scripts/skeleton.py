#!/usr/bin/env python3
"""Writes the catkin package that a student begins a lab with.

Usage: skeleton.py LAB DIRECTORY [--name PACKAGE]
       skeleton.py --list

Such as: skeleton.py turn ~/catkin_ws/src. The package has a launch file, and the lab's node: its
given parts are given, and its TODOs are open. What is already there is not overwritten. The texts
are the files of doc/skeletons.
"""
import sys
from pathlib import Path

import rospkg

from tb3_labs.command_line import Parser
from tb3_labs.handout.skeletons import (FOLDER, checked_name, checked_place, sentence, skeleton,
                                        write)
from tb3_labs.marking.labs import LABS

OWN_PACKAGE = 'tb3_labs'


def templates_of(lab):
    """The folder of a lab's templates."""
    return Path(rospkg.RosPack().get_path(OWN_PACKAGE)) / FOLDER / lab


def parse(words):
    """The command line's arguments."""
    parser = Parser(
        prog='skeleton.py', usage='skeleton.py LAB DIRECTORY [--name PACKAGE] | --list',
        description='Writes the catkin package that a student begins a lab with: a launch file, and '
        "the lab's node with its TODOs. What is already there is not overwritten.",
        epilog='Such as: rosrun tb3_labs skeleton.py turn ~/catkin_ws/src')
    parser.add_argument('lab', metavar='LAB', nargs='?', choices=list(LABS), help=', '.join(LABS))
    parser.add_argument('folder', metavar='DIRECTORY', nargs='?', type=Path,
                        help='the folder src of a catkin workspace')
    parser.add_argument('--name', metavar='PACKAGE', help="the package's name; default: the handout's")
    parser.add_argument('--list', action='store_true', help='print the labs, their packages and nodes')
    given = parser.parse_args(words)
    if not given.list and given.folder is None:
        parser.error('LAB and DIRECTORY are missing, such as: turn ~/catkin_ws/src')
    return given


def main(words):
    """Write the package, or list the labs; the exit status."""
    given = parse(words)
    try:
        return tell_labs() if given.list else begin(given)
    except OSError as problem:
        return tell_problem('{}: {}'.format(problem.filename, problem.strerror))
    except ValueError as problem:
        return tell_problem(problem)


def begin(given):
    """Write the package, and tell what comes next; the exit status."""
    lab = LABS[given.lab]
    package, node = given.name or lab.packages[0], lab.files[0]
    checked_name(package, [OWN_PACKAGE, Path(node).stem])
    target = checked_place(given.folder.expanduser().resolve()) / package
    try:
        write(skeleton(templates_of(given.lab), package), target)
    except FileExistsError:
        return tell_problem('{} is already there, and stays as it is; --name gives another name, or '
                            'give another folder'.format(target))
    source = target.parent
    print('{} is written. The TODOs are in src/{}. Next: cd {}; catkin_make; source devel/setup.bash;'
          ' roslaunch {} {}.launch sim:=true'.format(
              target, node, source.parent if source.name == 'src' else 'WORKSPACE', package,
              given.lab))
    return 0


def tell_labs():
    """Print a row for each lab: its package, its node, a sentence; the exit status."""
    for name, lab in LABS.items():
        package = lab.packages[0]
        print('{:10} {:13} {:24} {}'.format(name, package, lab.files[0], sentence(
            skeleton(templates_of(name), package))))
    return 0


def tell_problem(problem):
    """Print why nothing was written; the exit status."""
    print('skeleton.py: {}'.format(problem), file=sys.stderr)
    return 2


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
