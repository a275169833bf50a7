#!/usr/bin/env python3
"""Would a test notice? Makes small changes to copies of the package, runs the unit tests on them.

    source scripts/setup.sh
    test/mutation/mutate.py                                 150 changes, drawn over all pure rooms
    test/mutation/mutate.py -n 60 --seed 7 -r simulation    60 others, of one room
    test/mutation/mutate.py -r report -t test_report.py     noticed by this file's tests alone?

Each change (see mutations.py) is made in a copy in a temporary folder, which comes first on the
path of a process of its own; the checkout is read once, at the beginning, and stays as it is. The
tests of a change are those that run its block; for a constant of a module, those that run anything
of the module or of one that imports it. They are found by one run of all tests on a copy whose blocks leave marks. The fastest come first, up
to --patience seconds of computing, and the first failure ends it. A test that computes for five
times as long as usual hangs: that counts as noticed, and is listed.

Prints each change that survives, and a table by room: without the boundaries, too (`<` for `<=`),
since most of them differ in one value of a float only. Not part of the test suite. Limits: a test
that computes in other processes is not seen to run the package; a machine so busy that a test fails
by time alone makes a change look noticed.
"""
import argparse
import ast
import concurrent.futures
import itertools
import json
import os
import pathlib
import queue
import random
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from dataclasses import dataclass
from typing import Dict, List, Set, Tuple

from chosen_tests import HANG
from mutations import Mutation, blocks_of, mutations_of

ROOT = pathlib.Path(__file__).resolve().parents[2]
PACKAGE, SUITE = pathlib.Path('src', 'tb3_labs'), pathlib.Path('test', 'unit')
#: What is pure: all that the unit tests can judge.
ROOMS = ('geometry', 'robot', 'localization', 'control', 'supervision', 'nodes', 'simulation',
         'report', 'marking')
#: A process that has not ended by then waits for something that never comes [s].
LONGEST = 900.0
MARK = "__import__('builtins').__dict__.setdefault('_mutation_marks', set()).add({!r})\n"


@dataclass(frozen=True)
class Test:
    """A unit test: pytest's name, seconds of computing, (path, line) of each block it runs."""

    name: str
    seconds: float
    blocks: Set[Tuple[str, int]]

    @property
    def path(self) -> str:
        """Its file, from the checkout's root."""
        return self.name.split('::')[0]


class Copy:
    """The checkout in a folder of its own, and a way to run its tests."""

    def __init__(self, folder: pathlib.Path) -> None:
        self.root = folder / 'copy'
        shutil.copytree(str(ROOT), str(self.root), ignore=shutil.ignore_patterns(
            'build', '.git', '__pycache__', '.*_cache', '.hypothesis'))
        # Messages and services are generated elsewhere; all else comes from the copy.
        import tb3_labs.msg
        generated = pathlib.Path(tb3_labs.msg.__file__).parents[1]
        first = folder / 'first'
        (first / 'tb3_labs').mkdir(parents=True)
        (first / 'tb3_labs' / '__init__.py').write_text('__path__ = {!r}\n'.format(
            [str(self.root / PACKAGE), str(generated)]))
        self._stamps = itertools.count(1)
        self.folder = folder
        self._environment = dict(
            os.environ, HYPOTHESIS_STORAGE_DIRECTORY=str(folder / 'hypothesis'),
            PYTHONPYCACHEPREFIX=str(folder / 'bytecode'), MPLBACKEND='agg',
            PYTHONPATH=os.pathsep.join([str(first), str(pathlib.Path(__file__).parent),
                                        os.environ.get('PYTHONPATH', '')]))
        self._environment.pop('PYTHONDONTWRITEBYTECODE', None)

    def write(self, path: str, text: str) -> None:
        """Change a file, with a time no byte code was made at: equal times would hide a change."""
        (self.root / path).write_text(text, encoding='utf-8')
        stamp = next(self._stamps)
        os.utime(str(self.root / path), (stamp, stamp))

    def run(self, tests: List[str], **variables: str) -> int:
        """The exit status of pytest; `HANG` also for one that waits for ever."""
        command = [sys.executable, '-m', 'pytest', '-q', '--no-header', '-p', 'no:cacheprovider',
                   '-p', 'chosen_tests', '--rootdir', str(self.root)] + tests
        with open(str(self.folder / 'output'), 'w') as output:
            try:
                return subprocess.run(
                    command, cwd=str(self.root), env=dict(self._environment, **variables),
                    stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT,
                    timeout=LONGEST).returncode
            except subprocess.TimeoutExpired:
                return HANG

    def outcome(self, mutation: Mutation, source: str, tests: List[Test]) -> str:
        """'' if no test fails, else 'killed' or 'hang'; `source` is the file's without it."""
        chosen = self.folder / 'chosen.json'
        chosen.write_text(json.dumps([[test.name, test.seconds] for test in tests]))
        self.write(mutation.path, mutation.applied(source))
        status = self.run(['-x'] + sorted({test.path for test in tests}),
                          MUTATION_TESTS=str(chosen))
        self.write(mutation.path, source)
        return {0: '', HANG: 'hang'}.get(status, 'killed')


def texts(root: pathlib.Path, folder: pathlib.Path) -> Dict[str, str]:
    """{path: text} of the Python files in a folder, by their path from `root`."""
    return {str(path.relative_to(root)): path.read_text(encoding='utf-8')
            for path in sorted((root / folder).rglob('*.py'))}


def room_of(path: str) -> str:
    """The room that a file of the package lies in."""
    return pathlib.Path(path).relative_to(PACKAGE).parts[0]


def with_marks(path: str, source: str) -> str:
    """The source, with a mark in front of each block."""
    lines = source.splitlines(keepends=True)
    for line, column, _ in sorted(set(blocks_of(source)), reverse=True):
        lines.insert(line - 1, ' ' * column + MARK.format('{}:{}'.format(path, line)))
    return ''.join(lines)


def watch(copy: Copy, package: Dict[str, str], files: List[str]) -> List[Test]:
    """All tests of these files that pass, with what each of them runs."""
    seen = copy.folder / 'seen.json'
    for path, source in package.items():
        if room_of(path) in ROOMS:
            copy.write(path, with_marks(path, source))
    copy.run(files, MUTATION_SEEN=str(seen))
    for path, source in package.items():
        copy.write(path, source)
    if not seen.exists():
        raise RuntimeError('the tests do not run: ' + (copy.folder / 'output').read_text()[-2000:])
    return [Test(name, seconds, {(mark.rpartition(':')[0], int(mark.rpartition(':')[2]))
                                 for mark in marks})
            for name, (seconds, marks) in json.loads(seen.read_text()).items()]


def imports_of(source: str) -> Set[str]:
    """Paths of the package's files that a source imports."""
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom) and (node.module or '').startswith('tb3_labs'):
            names |= {node.module} | {'{}.{}'.format(node.module, part.name) for part in node.names}
    return {str(pathlib.Path('src', *name.split('.'))) + '.py' for name in names}


class Choice:
    """Which tests can notice a change."""

    def __init__(self, tests: List[Test], package: Dict[str, str], suite: Dict[str, str],
                 patience: float) -> None:
        self._tests = sorted(tests, key=lambda test: test.seconds)
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
        if around:
            able = [test for test in self._tests if (mutation.path, max(around)) in test.blocks]
        else:
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
    """How many were noticed, by room."""
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
                                 (files[number::given.jobs] for number in range(given.jobs)))
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
    parser = argparse.ArgumentParser(description=(__doc__ or '').split('\n')[0])
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
