#!/usr/bin/env python3
"""Would a test notice? Makes small changes to copies of the package, runs the unit tests on them.

    source scripts/setup.sh
    test/mutation/mutate.py                                 150 changes, drawn over all pure rooms
    test/mutation/mutate.py -n 60 --seed 7 -r simulation    60 others, of one room
    test/mutation/mutate.py -r report -t test_report.py     noticed by this file's tests alone?

Each change (see mutations.py) is made in a copy in a temporary folder, which comes first on the
path of a process of its own; the checkout is read once, at the beginning, and stays as it is. The
tests of a change are those that run its block. For what runs at an import, as a module's constants
do, or is seen to run in no test, they are those that run anything of the module or of one that
imports it. They are found by one run of all tests on copies whose blocks leave marks. The fastest
come first, up to --patience seconds of computing, and the first failure ends it. A test that
computes for five times as long as usual hangs: that counts as noticed, and is listed.

Prints each change that survives, and a table by room: without the boundaries, too (`<` for `<=`),
since most of them differ in one value of a float only. Not part of the test suite. Limits: code
that runs in another process is not seen to run; a machine so busy that a test fails by time alone
makes a change look noticed.
"""
import argparse
import ast
import concurrent.futures
import itertools
import pathlib
import queue
import random
import sys
import tempfile
from collections import Counter
from typing import Dict, List, Set, Tuple

sys.dont_write_bytecode = True      # nothing is left beside these files

from copies import PACKAGE, ROOMS, Copy, Test, room_of, texts, watch  # noqa: E402
from mutations import Mutation, blocks_of, mutations_of  # noqa: E402

SUITE = pathlib.Path('test', 'unit')


def imports_of(source: str) -> Set[str]:
    """Paths of the package's files that a source imports."""
    names: Set[str] = set()
    for node in ast.walk(ast.parse(source)):
        module = node.module or '' if isinstance(node, ast.ImportFrom) else ''
        if isinstance(node, ast.ImportFrom) and module.startswith('tb3_labs'):
            names |= {module} | {'{}.{}'.format(module, part.name) for part in node.names}
    return {str(pathlib.Path('src', *name.split('.'))) + '.py' for name in names}


class Choice:
    """The tests that can notice a change."""

    def __init__(self, tests: List[Test], package: Dict[str, str], suite: Dict[str, str],
                 patience: float) -> None:
        self._tests = sorted((test for test in tests if test.name), key=lambda test: test.seconds)
        self._at_import = set().union(*(test.blocks for test in tests if not test.name))
        self._patience = patience
        self._blocks = {path: sorted(set(blocks_of(source))) for path, source in package.items()}
        self._importers: Dict[str, Set[str]] = {}
        for path, source in itertools.chain(package.items(), suite.items()):
            for imported in imports_of(source):
                self._importers.setdefault(imported, set()).add(path)

    def of(self, mutation: Mutation) -> List[Test]:
        """The fastest first, as many as patience allows."""
        around = [line for line, _, last in self._blocks[mutation.path]
                  if line <= mutation.line <= last]
        block = (mutation.path, max(around, default=0))
        able = [test for test in self._tests if block in test.blocks]
        if not able or block in self._at_import:
            files = self._importers.get(mutation.path, set()) | {mutation.path}
            able = [test for test in self._tests
                    if test.path in files or any(path in files for path, _ in test.blocks)]
        total = itertools.accumulate(test.seconds for test in able)
        return [test for test, until in zip(able, total) if until <= self._patience]


def draw(package: Dict[str, str], number: int, seed: int, rooms: List[str]) -> List[Mutation]:
    """`number` mutations of the rooms, or all there are, by path and line."""
    everything = [mutation for path, source in package.items() if room_of(path) in rooms
                  for mutation in mutations_of(path, source)]
    drawn = random.Random(seed).sample(everything, min(number, len(everything)))
    return sorted(drawn, key=lambda mutation: (mutation.path, mutation.line, mutation.column))


def table(outcomes: List[Tuple[Mutation, str]]) -> str:
    """The numbers of noticed changes, by room."""
    row = '{:14} {:>6} {:>8} {:>6} {:>9} {:>9} {:>19}'
    lines = [row.format('room', 'drawn', 'noticed', 'hangs', 'survived', 'noticed',
                        'without boundaries')]
    rooms = sorted({room_of(mutation.path) for mutation, _ in outcomes})
    for room in rooms + ['all']:
        own = [(m, outcome) for m, outcome in outcomes if room in (room_of(m.path), 'all')]
        count = Counter(outcome for _, outcome in own)
        firm = [outcome for m, outcome in own if m.kind != 'boundary']
        lines.append(row.format(
            room, len(own), len(own) - count[''], count['hang'], count[''],
            _share(len(own) - count[''], len(own)),
            _share(sum(outcome != '' for outcome in firm), len(firm))))
    return '\n'.join(lines)


def _share(part: int, whole: int) -> str:
    return '{:.0f} %'.format(100.0 * part / whole) if whole else ''


class Judge:
    """The copies, and the tests that can notice a change in them."""

    def __init__(self, given: argparse.Namespace, folder: pathlib.Path) -> None:
        copies = [Copy(folder / str(number)) for number in range(given.jobs)]
        self.package = texts(copies[0].root, PACKAGE)
        suite = {path: text for path, text in texts(copies[0].root, SUITE).items()
                 if not given.tests or pathlib.Path(path).name in given.tests}
        files = [path for path in suite if pathlib.Path(path).name.startswith('test_')]
        self._pool = concurrent.futures.ThreadPoolExecutor(given.jobs)
        watched = self._pool.map(watch, copies, itertools.repeat(self.package),
                                 (files[number::given.jobs] for number in range(len(files))))
        tests = [test for part in watched for test in part]
        self._choice = Choice(tests, self.package, suite, given.patience)
        self._idle: 'queue.Queue[Copy]' = queue.Queue()
        for copy in copies:
            self._idle.put(copy)

    def outcomes(self, mutations: List[Mutation]) -> List[Tuple[Mutation, str]]:
        """Each mutation with its outcome; prints what survives or hangs as soon as it is known."""
        with self._pool as pool:
            return list(zip(mutations, pool.map(self._outcome, mutations)))

    def _outcome(self, mutation: Mutation) -> str:
        tests, copy = self._choice.of(mutation), self._idle.get()
        try:
            outcome = copy.outcome(mutation, self.package[mutation.path], tests) if tests else ''
        finally:
            self._idle.put(copy)
        if outcome != 'killed':
            print('{:8} {}:{}  {}  [{}, {} tests]'.format(
                outcome or 'survived', mutation.path, mutation.line, mutation.in_words(),
                mutation.kind, len(tests)), flush=True)
        return outcome


def main() -> int:
    """Draw, run, report; the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').partition('\n')[0])
    parser.add_argument('-n', '--number', type=int, default=150, help='changes drawn')
    parser.add_argument('-s', '--seed', type=int, default=1, help='of the draw')
    parser.add_argument('-r', '--room', action='append', choices=ROOMS, help='only this one')
    parser.add_argument('-t', '--tests', action='append', metavar='FILE',
                        help='only the tests of this file of test/unit')
    parser.add_argument('-p', '--patience', type=float, default=20.0,
                        help='tests of this much computing, at most, for each change [s]')
    parser.add_argument('-j', '--jobs', type=int, default=2, help='changes judged at a time')
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix='mutations_') as folder:
        judge = Judge(given, pathlib.Path(folder))
        print(table(judge.outcomes(draw(judge.package, given.number, given.seed,
                                        given.room or list(ROOMS)))))
    return 0


if __name__ == '__main__':
    sys.exit(main())
