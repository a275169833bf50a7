#!/usr/bin/env python3
"""Marks a folder of submissions by the criteria of their lab, on the embedded robot.

Usage: mark.py SUBMISSIONS --lab turn -o MARKS

SUBMISSIONS holds one folder for each student, with a catkin package somewhere below. MARKS gets
marks.csv, overview.html, and a page of feedback for each student. doc/marking.md tells more.
"""
import argparse
import signal
import sys
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

import yaml

from tb3_labs.marking.labs import LABS
from tb3_labs.marking.marks import write_csv
from tb3_labs.marking.page import feedback, overview
from tb3_labs.marking.points import points_of
from tb3_labs.ros.marking.marker import Marker, points_file
from tb3_labs.simulation.network import NETWORKS


def parse(words):
    """The command line's arguments."""
    parser = argparse.ArgumentParser(
        prog='mark.py', description='Marks a folder of submissions, one folder for each student.')
    parser.add_argument('submissions', metavar='SUBMISSIONS', type=Path)
    parser.add_argument('--lab', required=True, choices=sorted(LABS))
    parser.add_argument('-o', dest='folder', metavar='MARKS', type=Path, required=True,
                        help='folder for what is written')
    parser.add_argument('--points', type=Path, help='YAML file with what each criterion is worth; '
                        'default: test/marking/points.yaml of this package')
    parser.add_argument('--type', metavar='NAME', help="the node's file, if it is not called as in "
                        'the lab')
    parser.add_argument('--parts', default='', help='only these parts of the lab, with commas: '
                        + '; '.join('{}: {}'.format(name, ', '.join(lab.parts))
                        for name, lab in sorted(LABS.items())))
    parser.add_argument('--limit', type=float, default=300.0, metavar='SECONDS',
                        help='for one submission; default: %(default)g')
    parser.add_argument('--network', choices=list(NETWORKS), default='quiet',
                        help='between robot and node; default: %(default)s')
    parser.add_argument('--jobs', type=int, default=1, choices=range(1, 17), metavar='N',
                        help='submissions at a time; each needs about one processor core')
    return parser.parse_args(words)


def main(words):
    """Mark all, write all; the exit status."""
    given = parse(words)
    lab = LABS[given.lab]
    parts = [part.strip() for part in given.parts.split(',') if part.strip()]
    try:
        if not set(parts) <= set(lab.parts):
            raise ValueError('lab {} has these parts: {}'.format(given.lab, ', '.join(lab.parts)))
        with open(str(given.points or points_file())) as file:
            worth = points_of(given.lab, lab.criteria, yaml.safe_load(file))
        folders = sorted(path for path in given.submissions.iterdir() if path.is_dir()
                         and not path.name.startswith('.'))
        if not folders:
            raise ValueError('there is no folder in {}'.format(given.submissions))
        (given.folder / 'logs').mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError, yaml.YAMLError) as problem:
        print('mark.py: {}'.format(problem), file=sys.stderr)
        return 2
    for path in sorted(given.submissions.iterdir()):
        if not path.is_dir():
            print('mark.py: left out, because it is no folder: {}'.format(path), file=sys.stderr)
    marker = Marker(given.lab, worth, given.folder / 'logs', parts,
                    (given.type,) if given.type else (), given.limit, given.network)
    return mark_all(marker, folders, given)


def mark_all(marker, folders, given):
    """Mark the submissions, tell how far it is, write what there is; the exit status."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    title, done, failed = LABS[given.lab].title, {}, False

    def mark(number, folder):
        # one write: several threads tell
        sys.stdout.write('[{}/{}] {} ...\n'.format(number, len(folders), folder.name))
        sys.stdout.flush()
        begun = time.monotonic()
        return marker.mark(folder), time.monotonic() - begun

    with ThreadPoolExecutor(given.jobs) as pool:
        jobs = {pool.submit(mark, number, folder): number
                for number, folder in enumerate(folders, 1)}
        try:
            for job in as_completed(jobs):
                try:
                    marks, seconds = job.result()
                except OSError as problem:
                    print('mark.py: {}'.format(problem), file=sys.stderr)
                    failed = True
                    continue
                done[jobs[job]] = marks
                failed = failed or marks.failed
                (given.folder / (marks.student + '.html')).write_text(
                    feedback(marks, title), encoding='utf-8')
                print('[{}/{}] {}: {:g} of {:g} points, {:.0f} s'.format(
                    jobs[job], len(folders), marks.student, marks.points, marks.worth, seconds),
                    flush=True)
        except KeyboardInterrupt:
            print('mark.py: interrupted; what is done is written', file=sys.stderr)
            failed = True
            for job in jobs:
                job.cancel()
            marker.interrupt()
    if done:
        all_marks = [done[number] for number in sorted(done)]
        write_csv(all_marks, given.folder / 'marks.csv')
        (given.folder / 'overview.html').write_text(overview(
            all_marks, title, [marks.student + '.html' for marks in all_marks]), encoding='utf-8')
        print('Overview: {}'.format(given.folder / 'overview.html'))
    return 1 if failed else 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
