#!/usr/bin/env python3
"""How often is the diagnosis of a run right? Nodes with a mistake, right ones, and unknown mistakes
drive simulated robots; the diagnosis sees only what a bag would hold.

    python3 test/benchmark/diagnosis.py --runs 300 --seed 1
    python3 test/benchmark/diagnosis.py --only not_rotated

Half of the runs are of right nodes, three in ten of known mistakes, each as often, and two in ten
of unknown ones. A mistake that cannot be seen in its scene is no run: then the right node moves the
same way there. Nor are two mistakes of which only one shows. Each run is made from its own number
alone: `--run 17 --seed 1` makes it again.
"""
import argparse
import collections
import os
import random
import sys
from concurrent.futures import ProcessPoolExecutor

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), os.pardir, 'unit'))
from mutants import (    # noqa: E402
    SAME, UNKNOWN, agree, known, mistaken_nodes, nodes_like, right_node, same_commands,
    scene_of, unknown_node)
from student_runs import played    # noqa: E402
from tb3_labs.report.diagnosis import diagnose    # noqa: E402

#: The kinds of ten runs in a row; the right ones in the labs' order.
KINDS = ('right', 'known', 'right', UNKNOWN, 'right', 'known', 'right', UNKNOWN, 'right', 'known')
RIGHT_LABS = 'turn', 'drive', 'turn', 'drive', 'turn', 'drive', 'turn', 'drive', 'drive', 'pad'
#: At most this number of scenes is tried until a mistake can be seen.
TRIES = 40


def chosen(number, own, only):
    """Returns the node of run `number`, its scene, and the seed of the recorder."""
    source, tens, before = random.Random(own), number // 10, KINDS[:number % 10]
    kind = KINDS[number % 10]
    if only:
        kind = only if only in ('right', UNKNOWN) else 'known'
    if kind == 'right':
        node = right_node(RIGHT_LABS[number % 10 if only else (
            5 * tens + before.count('right')) % 10], source)
    elif kind == UNKNOWN:
        node = unknown_node(source)
    else:
        names = [pair for pair in known() if not only or pair[1] == only]
        turn = number if only else 3 * tens + before.count('known')
        node = source.choice(mistaken_nodes(*names[turn % len(names)], source))
    return node, scene_of(node, source), source.randrange(2 ** 31)


def made(number, seed, only):
    """Returns run `number` as a dict: identifier, lab, words, and the guess."""
    for attempt in range(TRIES):
        own = '{}/{}/{}'.format(seed, number, attempt)
        node, scene, scene_seed = chosen(number, own, only)
        run = played(node.text, scene, scene_seed)
        hidden = [node.right] * bool(node.mistake) + [
            other.text for part in node.parts for other in nodes_like(node, part)]
        if not any(agree(run, played(text, scene, scene_seed)) for text in hidden):
            break
    else:
        return None
    found = diagnose(run)
    guess = found.mistake
    return dict(number=number, identifier=node.mistake, lab=node.lab, words=node.words, guess=guess,
                same=is_same(node, guess, scene, scene_seed, run)
                or bool(found.besides) and set(node.parts) == {guess, found.besides})


def is_same(node, guess, scene, scene_seed, run):
    """Does the guessed mistake, played in the same scene, make the same run? Of two unknown
    mistakes at once only one may show, and that is a known one."""
    if node.mistake != UNKNOWN and (node.lab, frozenset((node.mistake, guess))) not in SAME:
        return False
    others = (played(other.text, scene, scene_seed) for other in nodes_like(node, guess))
    return any(agree(run, other) and same_commands(run, other) for other in others)


def is_right(made_run):
    """Is the guess right?"""
    if made_run['identifier'] == UNKNOWN:
        return made_run['guess'] is None or made_run['same']
    return made_run['guess'] == made_run['identifier'] or made_run['same']


def print_table(runs):
    """Print the guesses for each mistake, the figures, and the misses."""
    table = collections.defaultdict(collections.Counter)
    for each in runs:
        table[each['lab'], each['identifier'] or 'right'][shown(each)] += 1
    for (lab, mistake), guesses in sorted(table.items()):
        print('{:6}{:24}{:4}   {}'.format(lab, mistake, sum(guesses.values()), ', '.join(
            '{} {}'.format(guess, count) for guess, count in guesses.most_common())))
    right = [each for each in runs if not each['identifier']]
    unknown = [each for each in runs if each['identifier'] == UNKNOWN]
    mistaken = [each for each in runs if each['identifier'] not in ('', UNKNOWN)]
    print('\nright first guess      {:5.1f} % of {} runs of known mistakes'.format(
        percent(mistaken), len(mistaken)))
    accused = [each for each in right if each['guess'] != '']
    print('false accusations      {:5d}   of {} runs of right nodes ({} of them: none fits)'.format(
        len([each for each in accused if each['guess']]), len(right),
        len([each for each in accused if each['guess'] is None])))
    print('none fits              {:5.1f} % of {} runs of unknown mistakes'.format(
        percent(unknown), len(unknown)))
    misses = [each for each in runs if not is_right(each)]
    print('\nmisses: number, lab, mistake (what it does): guess')
    for each in misses:
        print('{number:5d} {lab:6}{0} ({words}): {1}'.format(
            each['identifier'] or 'right', shown(each), **each))


def shown(made_run):
    """The guess in words; '=' if it is another name of the same run."""
    guess = made_run['guess']
    return ('none fits' if guess is None else guess or 'right') + '=' * made_run['same']


def percent(runs):
    """The share of right guesses [%]."""
    return 100.0 * sum(map(is_right, runs)) / len(runs) if runs else 0.0


def main():
    """Make the runs, ask, and print."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--runs', type=int, default=300)
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--only', help='one identifier, or "right" or "unknown"')
    parser.add_argument('--run', type=int, help='only the run of this number')
    asked = parser.parse_args()
    if asked.only not in (None, 'right', UNKNOWN, *(mistake for _, mistake in known())):
        parser.error('no mistake is called ' + asked.only)
    numbers = range(asked.runs) if asked.run is None else [asked.run]
    with ProcessPoolExecutor(2) as workers:
        results = list(workers.map(made, numbers, [asked.seed] * len(numbers),
                                   [asked.only] * len(numbers), chunksize=3))
    runs = [each for each in results if each]
    print_table(runs)
    print('\n{} runs; {} mistakes could not be seen'.format(len(runs), len(results) - len(runs)))


if __name__ == '__main__':
    main()
