#!/usr/bin/env python3
"""Writes the students' edition of this package, without the solutions, into a new folder.

Usage: edition.py student ~/students/tb3_labs

The file doc/instructor/edition.txt lists what is left out. The instructor's edition is the
repository. The exit status is 0 only if all files are written.
"""
import sys
from pathlib import Path

import rospkg

from tb3_labs.command_line import Parser
from tb3_labs.handout.edition import LIST, checked_place, write


def sources():
    """Returns the folder of this package's sources; ``ValueError`` if they are not installed."""
    package = Path(rospkg.RosPack().get_path('tb3_labs'))
    root = (package / 'package.xml').resolve().parent    # scripts/setup.sh makes a folder of links
    if not (root / LIST).is_file() or not (root / 'CMakeLists.txt').is_file():
        raise ValueError('{} has no sources: an edition is made from a clone of tb3_labs, not from '
                         'an installed package'.format(root))
    return root


def main(words):
    """Write the edition. Returns the exit status."""
    parser = Parser(
        prog='edition.py', description="Writes the students' edition of tb3_labs, without the "
        'solutions. Example: edition.py student ~/students/tb3_labs',
        epilog=LIST + ' lists what is left out.')
    parser.add_argument('edition', metavar='EDITION', choices=['student'], help='student')
    parser.add_argument('folder', metavar='DIRECTORY', type=Path,
                        help='a new folder, outside of this package')
    given = parser.parse_args(words)
    try:
        root = sources()
        place = checked_place(given.folder, root)
        count = write(root, place)
    except (OSError, ValueError, rospkg.ResourceNotFound) as problem:
        print('edition.py: {}'.format(problem), file=sys.stderr)
        return 1
    print('{}: {} files; {} lists what is left out'.format(place, count, LIST))
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
