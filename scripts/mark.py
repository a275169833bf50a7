#!/usr/bin/env python3
"""Marks a folder of submissions by the criteria of their lab, on the embedded robot.

Usage: mark.py SUBMISSIONS --lab turn -o MARKS

SUBMISSIONS has one folder for each student, with a catkin package somewhere below. MARKS gets
marks.csv, overview.html, and a page of feedback for each student. doc/marking.md tells more.
"""
import argparse
import signal
import sys
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

import yaml

from tb3_labs.marking.conduct import UNPROTECTED, for_instructor
from tb3_labs.marking.labs import LABS
from tb3_labs.marking.marks import write_csv
from tb3_labs.marking.page import feedback, overview
from tb3_labs.marking.points import points_of
from tb3_labs.ros.marking import box
from tb3_labs.ros.marking.marker import QUIET, Marker, points_file
from tb3_labs.ros.marking.programs import node_texts, own_programs
from tb3_labs.simulation.network import NETWORKS


def parse(words):
    """The command line's arguments."""
    parser = argparse.ArgumentParser(
        prog='mark.py', description='Marks a folder of submissions, one folder for each student.')
    parser.add_argument('submissions', metavar='SUBMISSIONS', type=Path)
    parser.add_argument('--lab', required=True, choices=sorted(LABS))
    parser.add_argument('-o', dest='folder', metavar='MARKS', type=Path, required=True,
                        help='folder for the marks and pages')
    parser.add_argument('--points', type=Path, help='YAML file with the points of each criterion; '
                        'default: test/marking/points.yaml of this package')
    parser.add_argument('--type', metavar='NAME', help="the node's file, if its name is not that "
                        'of the lab')
    parser.add_argument('--parts', default='', help='these parts of the lab alone, with commas: '
                        + '; '.join('{}: {}'.format(name, ', '.join(lab.parts))
                        for name, lab in sorted(LABS.items())))
    parser.add_argument('--limit', type=float, default=300.0, metavar='SECONDS',
                        help='for one submission; default: %(default)g')
    parser.add_argument('--network', choices=list(NETWORKS), default=QUIET,
                        help='between robot and node; default: %(default)s')
    parser.add_argument('--jobs', type=int, default=1, choices=range(1, 17), metavar='N',
                        help='submissions at a time; each needs about one processor core')
    parser.add_argument('--unprotected', action='store_true', help='mark without boxes: the '
                        "submissions' programs can read and delete your files")
    return parser.parse_args(words)


def main(words):
    """Mark all submissions, write the marks; the exit status."""
    given = parse(words)
    lab = LABS[given.lab]
    try:
        parts = lab.checked_parts(given.parts)
        with open(str(given.points or points_file())) as file:
            worth = points_of(given.lab, lab.criteria, yaml.safe_load(file))
        folders = submissions_in(given.submissions)
        check_boxes(given.unprotected)
        (given.folder / 'logs').mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError, yaml.YAMLError) as problem:
        tell_problem(problem)
        return 2
    marker = Marker(given.lab, worth, given.folder / 'logs', parts,
                    (given.type,) if given.type else (), given.limit, given.network,
                    not given.unprotected)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    pages = Pages(given.folder, lab.title, given.unprotected)
    done, failed = mark_all(marker, folders, given.jobs, pages)
    if done:
        pages.write_overview(done)
    return 1 if failed else 0


def check_boxes(unprotected):
    """Say that there is no protection; ``ValueError`` if that is not wanted, and boxes do not work
    here."""
    if unprotected:
        tell(UNPROTECTED)
    elif box.problem():
        raise ValueError('{}: programs of strangers cannot be kept in boxes here; nothing was '
                         'started. --unprotected marks without: {}'.format(
                             box.problem(), UNPROTECTED))


def submissions_in(folder):
    """The folders in a folder, sorted; anything else is told. ``ValueError`` if there is none."""
    paths = sorted(folder.iterdir())
    found = [path for path in paths if path.is_dir() and not path.name.startswith('.')]
    if not found:
        raise ValueError('there is no folder in {}'.format(folder))
    for path in paths:
        if not path.is_dir():
            tell_problem('left out, because it is no folder: {}'.format(path))
    return found


def mark_all(marker, folders, jobs, pages):
    """Mark the submissions, `jobs` at a time, and write each one's page.

    Returns the Marks of those that are done, in order, and whether anything failed.
    """
    done, failed, total = {}, False, len(folders)

    def mark(number, folder):
        tell('[{}/{}] {} ...'.format(number, total, folder.name))
        begun = time.monotonic()
        return number, marker.mark(folder), time.monotonic() - begun

    with ThreadPoolExecutor(jobs) as pool:
        tasks = [pool.submit(mark, number, folder) for number, folder in enumerate(folders, 1)]
        try:
            for task in as_completed(tasks):
                try:
                    number, marks, seconds = task.result()
                except OSError as problem:
                    tell_problem(problem)
                    failed = True
                    continue
                done[number] = marks
                failed = failed or marks.failed
                pages.write(marks)
                tell('[{}/{}] {}: {:g} of {:g} points, {:.0f} s'.format(
                    number, total, marks.student, marks.points, marks.worth, seconds))
        except KeyboardInterrupt:
            tell_problem('interrupted; the marks so far are written')
            failed = True
            for task in tasks:
                task.cancel()
            marker.interrupt()
    return [done[number] for number in sorted(done)], failed


class Pages:
    """What is written into the folder of the marks."""

    def __init__(self, folder, title, unprotected):
        """`title`: of the lab; `unprotected`: was there no box?"""
        self._folder, self._title, self._unprotected = folder, title, unprotected

    def write(self, marks):
        """Write the page of one student."""
        self._path(marks).write_text(feedback(marks, self._title), encoding='utf-8')

    def write_overview(self, all_marks):
        """Write the table of all marks, and the page of all students."""
        write_csv(all_marks, self._folder / 'marks.csv')
        path = self._folder / 'overview.html'
        notes = for_instructor(all_marks, node_texts(self._folder / 'logs'), own_programs(),
                               self._unprotected)
        path.write_text(overview(all_marks, self._title, [
            self._path(marks).name for marks in all_marks], notes), encoding='utf-8')
        for note in notes[self._unprotected:]:      # the first was told at the beginning
            tell(note)
        tell('Overview: {}'.format(path))

    def _path(self, marks):
        return self._folder / (marks.student + '.html')


def tell(line):
    """Print a line by one write, since several threads print."""
    sys.stdout.write(line + '\n')
    sys.stdout.flush()


def tell_problem(problem):
    """Print why something was not done."""
    print('mark.py: {}'.format(problem), file=sys.stderr)


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
