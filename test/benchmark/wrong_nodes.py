"""Is each mistake named? Marks the nodes of wrong_nodes.yaml, and makes reports of their runs. Prints the first
sentences of each.

    python3 test/benchmark/wrong_nodes.py                   all of them; two hours on two cores
    python3 test/benchmark/wrong_nodes.py turn abs spin     those with one of these words in their name
    python3 test/benchmark/wrong_nodes.py --again FOLDER    the sentences again, from the recordings

A mistake is named if its words and its place in the sheet stand in the first two sentences of the check: the first
criterion that is not met, and the hint. A right node must not lose a point, and its report must not accuse it. The exit
status is 1 if less than nine of ten mistakes are named, or a right node is accused.
"""
import argparse
import re
import subprocess
import sys
import tempfile
from collections import Counter
from dataclasses import replace
from html import unescape
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[2]
TABLE = Path(__file__).with_suffix('.yaml')
NODES = {'imu': 'imu_sub.py', 'turn': 'plain_turtlebot_controller.py',
         'move2goal': 'plain_move2goal_tf.py', 'gamepad': 'plain_gamepad.py'}
#: The part of the mistakes that must be named.
BAR = 0.9


def read_table():
    """Returns the rows of the table, each with its lab."""
    table = yaml.safe_load(TABLE.read_text(encoding='utf-8'))
    return [dict(row, lab=lab) for lab, rows in table.items() for row in rows]


def changed(row):
    """Returns the text of the lab's plain node with the changes of a row."""
    text = (ROOT / 'scripts' / NODES[row['lab']]).read_text(encoding='utf-8')
    for old, new in row['changes']:
        assert old in text, (row['lab'], row['name'], old)
        text = text.replace(old, new)
    return text.replace('tb3_labs.msg', 'lab2.msg')


def is_named(row, said):
    """Are the words and the place of a wrong node in these sentences?"""
    return bool(re.search(row['words'], said, re.DOTALL)) and row['place'] in said


def observe(folder, rows):
    """Mark the nodes of these rows, and write the recordings into `folder`."""
    for lab in NODES:
        mine = [row for row in rows if row['lab'] == lab]
        for row in mine:
            place = folder / lab / 'submissions' / row['name']
            place.mkdir(parents=True)
            (place / NODES[lab].replace('plain_', '')).write_text(changed(row), encoding='utf-8')
        if mine:
            subprocess.run(
                ['rosrun', 'tb3_labs', 'mark.py', str(folder / lab / 'submissions'), '--lab', lab,
                 '-o', str(folder / lab / 'marks'), '--jobs', '2'],
                check=True, stdout=sys.stderr)


def record_of(folder, row):
    """Returns the path of the bag of a row's trial."""
    return folder / row['lab'] / 'marks' / 'logs' / (row['name'] + '.bag')


def sentences_of(seen, lab):
    """Returns (points lost, first sentences of the check, sentences of the report)."""
    from tb3_labs.marking.labs.criteria import Outcome
    from tb3_labs.marking.marks import Marks, marks_after_trial, points_of, read_points
    marks = marks_after_trial(Marks(''), seen, lab, points_of(lab, read_points(None)))
    missed = [verdict.sentence for verdict in marks.graded_verdicts if verdict.outcome is not Outcome.MET]
    lost = marks.full_points - marks.points
    said = missed[:1] + [marks.hint] if lost else marks.remarks
    return lost, ' '.join(filter(None, said)), reported(seen)


def reported(seen):
    """Returns the sentences of the report on the recording without its letters."""
    from tb3_labs.report.page.moments import hints_of_nodes, printed_faults
    from tb3_labs.recording.run_data import Numbers
    run = seen.recording
    words = [printed_faults(run), *hints_of_nodes(replace(run, letters=Numbers.none()))]
    return ' '.join(unescape(re.sub('<[^>]*>', '', each)) for each in words)


def main():
    from tb3_labs.marking.trial.from_bag import read_trial
    parser = argparse.ArgumentParser(description='How many mistakes are named?')
    parser.add_argument('words', nargs='*', help='only nodes with one of these words in lab or name')
    parser.add_argument('--again', type=Path, help='a folder of recordings')
    given = parser.parse_args()
    rows = [row for row in read_table() if not given.words or any(
        word in row['lab'] + ' ' + row['name'] for word in given.words)]
    folder = given.again or Path(tempfile.mkdtemp(prefix='wrong_nodes_'))
    if not given.again:
        observe(folder, rows)
    counts = Counter()      # {(is the node wrong?, is it judged as it should be?): number of nodes}
    for row in rows:
        if not record_of(folder, row).exists():
            continue
        lost, checked, report = sentences_of(read_trial(record_of(folder, row)), row['lab'])
        if row['words']:
            is_good = is_named(row, checked)
        else:
            is_good = not lost and not report.strip()
        counts[bool(row['words']), is_good] += 1
        verdict = 'ok  ' if is_good else 'MISS'
        print(f"{verdict} {row['lab']}: {row['name']}, {lost:g} points lost\n      {checked}\n    R {report}")
    named = counts[True, True]
    wrong = named + counts[True, False]
    accused = counts[False, False]
    print(f'{named} of {wrong} mistakes are named; {accused} right nodes are accused. The recordings: {folder}')
    return int(named < BAR * wrong or accused > 0)


if __name__ == '__main__':
    sys.exit(main())
