#!/usr/bin/env python3
"""Writes an edition of this package into a new folder: the students' is without the solutions.

Usage: edition.py student ~/tb3_labs        writes the students' edition
       edition.py student --list            prints what is left out, and why

What an edition leaves out stands in doc/edition.yaml, and what needs such a file follows. Pages
lose the passages between <!-- instructor only --> and <!-- end -->. The instructor's edition is the
repository. No master is needed. The exit status is 0 only if all was written.
"""
import os
import shutil
import subprocess
import sys
from pathlib import Path

import rospkg
import yaml

from tb3_labs.command_line import Parser
from tb3_labs.handout.edition import left_out, made, problems, rules_of

RULES = 'doc/edition.yaml'
#: Folders that are no part of the sources, where no git says so.
NO_SOURCES = {'build', '__pycache__'}
HIDDEN_SOURCES = {'.ci', '.devcontainer', '.dockerignore', '.gitattributes', '.gitignore',
                  '.run_test.py'}


def parse(words):
    """The command line's arguments."""
    parser = Parser(
        prog='edition.py', description='Writes an edition of tb3_labs: the students\' has no '
        'solutions. Example: edition.py student ~/tb3_labs',
        epilog='doc/edition.yaml says what an edition leaves out.')
    parser.add_argument('edition', metavar='EDITION', help='student')
    parser.add_argument('folder', metavar='DIRECTORY', nargs='?', type=Path,
                        help='a new folder, outside of this package')
    parser.add_argument('--list', action='store_true', dest='lists',
                        help='print what is left out, and why, and write nothing')
    given = parser.parse_args(words)
    if bool(given.folder) == given.lists:
        parser.error('give a DIRECTORY, or --list')
    return given


def sources():
    """The folder of this package's sources; ``ValueError`` if it is installed without them."""
    package = Path(rospkg.RosPack().get_path('tb3_labs'))
    root = (package / 'package.xml').resolve().parent    # scripts/setup.sh makes a folder of links
    if not (root / RULES).is_file() or not (root / 'CMakeLists.txt').is_file():
        raise ValueError('{} has no sources: an edition is made from a clone of tb3_labs, not from '
                         'an installed package'.format(root))
    return root


def paths_of(root):
    """The files of the package, relative to its folder: those that git tracks, or all sources."""
    if (root / '.git').exists():
        listed = subprocess.run(['git', 'ls-files', '-z'], cwd=str(root), stdout=subprocess.PIPE,
                                stderr=subprocess.DEVNULL, check=False)
        paths = [path for path in listed.stdout.decode().split('\0') if path]
        if listed.returncode == 0 and paths:
            return [path for path in paths if (root / path).is_file()]
    paths = []
    for folder, folders, names in os.walk(str(root)):
        folders[:] = [name for name in folders if is_source(name)]
        paths += [(Path(folder) / name).relative_to(root).as_posix()
                  for name in names if is_source(name) and not name.endswith('.pyc')]
    return paths


def is_source(name):
    """May a file or folder of this name be a source?"""
    return (name in HIDDEN_SOURCES or not name.startswith('.')) and (
        name not in NO_SOURCES and not name.endswith('.egg-info'))


def text_of(path):
    """The text of a file, '' if it is none."""
    try:
        return path.read_text(encoding='utf-8')
    except UnicodeDecodeError:
        return ''


def check_folder(folder, root):
    """Raise ``ValueError`` unless the edition can be written there."""
    place = folder.expanduser().resolve()
    if place == root or root in place.parents:
        raise ValueError('{} is inside of {}: give a folder outside of it'.format(place, root))
    if place.exists() and (not place.is_dir() or any(place.iterdir())):
        raise ValueError('{} exists and is not an empty folder: give a new one'.format(place))
    return place


def write(root, place, texts, edition):
    """Write the edition: changed pages as texts, all other files as they are."""
    for path, text in edition.items():
        target = place / path
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(str(root / path), str(target))    # with its permissions
        if text != texts[path]:
            target.write_text(text, encoding='utf-8')


def main(words):
    """Write the edition, or list what it leaves out; the exit status."""
    given = parse(words)
    try:
        root = sources()
        rules = rules_of(given.edition, yaml.safe_load(text_of(root / RULES)))
        place = None if given.lists else check_folder(given.folder, root)
        texts = {path: text_of(root / path) for path in sorted(paths_of(root))}
        gone = left_out(texts, rules)
        if given.lists:
            print('\n'.join('{:<44} {}'.format(*item) for item in sorted(gone.items())))
            return 0
        edition = made(texts, gone)
        lost = problems(edition, gone)
        if lost:
            raise ValueError('{}\n{}'.format(
                'nothing is written: what is left out must not be named. In a page, put such a '
                'passage between two lines, <!-- instructor only --> and <!-- end -->.',
                '\n'.join(lost)))
        write(root, place, texts, edition)
    except (OSError, ValueError, yaml.YAMLError, rospkg.ResourceNotFound) as problem:
        print('edition.py: {}'.format(problem), file=sys.stderr)
        return 1
    print('{}: {} files, {} left out (edition.py {} --list)'.format(
        place, len(edition), len(gone), given.edition))
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
