"""How often is the diagnosis of a run right? Right nodes, and nodes with a mistake, drive simulated
robots; the diagnosis sees only what a bag would hold.

    python3 test/benchmark/diagnosis.py --runs 300 --seed 1

Half of the runs are of right nodes; a person does there what the sheets ask for, and more. 'None
fits' accuses nobody. A mistake that cannot be seen in its scene is no run: then the
right node moves the same way there.
"""
import argparse
import collections
import os
import random
import sys
from concurrent.futures import ProcessPoolExecutor

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), os.pardir, 'unit'))
from mutants import agree, is_same, known, mistaken_node, scene_of
from right_runs import RIGHT, right_run
from student_runs import played
from tb3_labs.report.cause.diagnosis import diagnose
from tb3_labs.report.motion.movements import completed

#: The right runs: (lab, what a person does in it).
RIGHT_RUNS = [(lab, kind) for lab, kinds in RIGHT.items() for kind in kinds]
#: At most this number of scenes is tried until a mistake can be seen.
TRIES = 40


def made(number, seed):
    """(lab, mistake, what a person does, the diagnosis' guess) of run `number`; None if no mistake
    can be seen."""
    for attempt in range(TRIES):
        source = random.Random('{}/{}/{}'.format(seed, number, attempt))
        if number % 2:
            lab, kind = RIGHT_RUNS[number // 2 % len(RIGHT_RUNS)]
            text, scene, goal = right_run(lab, kind, source)
            run = completed(played(text, scene, source.randrange(2 ** 31)), goal)
            return lab, '', kind, diagnose(run).mistake
        lab, mistake = known()[number // 2 % len(known())]
        node = mistaken_node(lab, mistake, source)
        scene, recorder = scene_of(node, source), source.randrange(2 ** 31)
        run = played(node.text, scene, recorder)
        if not agree(run, played(node.right, scene, recorder)):
            return lab, mistake.split('/')[0], '', diagnose(run).mistake
    return None


def main():
    """Make the runs, ask, and print the guesses for each mistake."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--runs', type=int, default=300)
    parser.add_argument('--seed', type=int, default=1)
    asked = parser.parse_args()
    with ProcessPoolExecutor(2) as workers:
        runs = list(workers.map(made, range(asked.runs), [asked.seed] * asked.runs, chunksize=3))
    runs = [run for run in runs if run]
    table = collections.defaultdict(collections.Counter)
    for lab, mistake, kind, guess in runs:
        row = table[lab, mistake or ('right, ' + kind if kind else 'right')]
        row['none fits' if guess is None else guess or 'right'] += 1
    for (lab, mistake), guesses in sorted(table.items()):
        print('{:6}{:27}{:4}   {}'.format(lab, mistake, sum(guesses.values()), ', '.join(
            '{} {}'.format(guess, count) for guess, count in guesses.most_common())))
    guesses = [is_same(mistake, guess) for _, mistake, _, guess in runs if mistake]
    accused = [bool(guess) for _, mistake, _, guess in runs if not mistake]
    print('right first guess      {:5.1f} % of {} runs of known mistakes'.format(
        100.0 * sum(guesses) / len(guesses), len(guesses)))
    print('false accusations      {:5d}   of {} runs of right nodes'.format(
        sum(accused), len(accused)))


if __name__ == '__main__':
    main()
