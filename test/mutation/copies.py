"""Copies of the checkout in which tests run: on a change, or to see which code each test runs."""
import itertools
import json
import os
import pathlib
import shutil
import subprocess
import sys
from dataclasses import dataclass
from typing import Dict, List, Set, Tuple

from chosen_tests import HANG
from mutations import Mutation, blocks_of

ROOT = pathlib.Path(__file__).resolve().parents[2]
PACKAGE = pathlib.Path('src', 'tb3_labs')
#: The pure rooms: all that the unit tests can judge.
ROOMS = ('geometry', 'robot', 'localization', 'control', 'supervision', 'nodes', 'simulation',
         'report', 'marking', 'panel', 'doctor', 'handout', 'commissioning')
#: A process that runs for longer than this hangs [s].
LONGEST = 900.0
MARK = "__import__('builtins').__dict__.setdefault('_mutation_marks', set()).add({!r})\n"


@dataclass(frozen=True)
class Test:
    """A unit test: pytest's name, seconds of computing, (path, line) of each block it runs. The one
    without a name stands for the imports."""

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
        command = [sys.executable, '-m', 'pytest', '-q', '-p', 'no:cacheprovider',
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
    """The room that a file of the package lies in; a tool's own ROS is like the bridge."""
    path = pathlib.Path(path).relative_to(PACKAGE)
    return 'ros' if path.name.startswith('ros_') else path.parts[0]


def with_marks(path: str, source: str) -> str:
    """The source, with a mark in front of each block."""
    lines = source.splitlines(keepends=True)
    for line, column, _ in sorted(set(blocks_of(source)), reverse=True):
        lines.insert(line - 1, ' ' * column + MARK.format('{}:{}'.format(path, line)))
    return ''.join(lines)


def watch(copy: Copy, package: Dict[str, str], files: List[str]) -> List[Test]:
    """All tests of these files that pass, with the blocks that each of them runs."""
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
