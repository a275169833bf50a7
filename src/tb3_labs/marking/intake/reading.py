"""Reads a submission: it is copied, its node is chosen, and the needs of the node are found.

All this happens in a process of its own within limits: a file of a stranger may be made so that
reading it takes all memory, or hours. Then that process ends, not the marking.
"""
import json
import subprocess
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Callable, Dict, List, Sequence, Union

from tb3_labs.marking.intake.imports import needs_of
from tb3_labs.marking.intake.packages import (
    MANIFEST, NotJudged, digest, find_node, name_in, packages_in, source_of)
from tb3_labs.marking.intake.submissions import CLASS, Budget, Refused, Submission, unpack
from tb3_labs.marking.lab_names import NodeNames

#: The most that a call may use: memory [bytes], processor time [s].
MEMORY, COMPUTING = 10 ** 9, 120
PROGRAM = '''import importlib, json, sys
sys.path[:], module, name, arguments = json.load(sys.stdin)
json.dump(getattr(importlib.import_module(module), name)(*arguments), sys.stdout)
'''


@dataclass
class Reading:
    """What was handed in. Paths are relative to the folder of the copy."""

    digest: str                     # of all files of the copy
    remarks: List[str]              # sentences for the student
    look_at: List[str]              # sentences for the instructor
    node: str                       # its file
    package: str                    # the folder of its package
    name: str                       # the name in the package's package.xml; '' if it has none
    bad_name: str                   # a sentence on a package.xml without a valid name
    packages: Dict[str, str]        # the needed ones: name -> folder
    given: List[str]                # see imports.Needs
    unused: List[str]


def read(submission: Submission, folder: Path, lab: NodeNames, package: str = '',
         name: str = '') -> Reading:
    """The Reading of a submission, copied into `folder`, which is made. `package`, `name`: of the
    node, if given. ``NotJudged`` if no file can be the node, or if it lacks modules."""
    try:
        said = _call(_read, submission.student, list(map(str, submission.paths)),
                     submission.names, str(folder), lab, package, name)
    except _TooMuch as problem:
        raise NotJudged('It cannot be read: {}.'.format(problem)) from None
    if isinstance(said, str):
        raise NotJudged(said)
    return Reading(**said)


def unpack_class(path: Path, folder: Path) -> None:
    """Unpack the zip file of a class. ``Refused`` if it must not be."""
    try:
        problem = _call(_unpack_class, str(path), str(folder))
    except _TooMuch as problem_of_it:
        problem = 'The zip file cannot be unpacked: {}.'.format(problem_of_it)
    if problem:
        raise Refused(problem)


# -- in the process of its own

class _TooMuch(Exception):
    """The call failed, most likely at a limit; the text is a clause."""


def _call(function: Callable[..., Any], *arguments: Any) -> Any:
    """The result of a module's function. Arguments and result pass as JSON.

    ``_TooMuch`` if it has none.
    """
    done = subprocess.run(
        ['prlimit', '--as={}'.format(MEMORY), '--cpu={}'.format(COMPUTING), '--core=0',
         sys.executable, '-c', PROGRAM],
        input=json.dumps([sys.path, function.__module__, function.__name__, arguments]),
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True,
        cwd='/',                    # Python looks for modules in its folder
        start_new_session=True)     # Ctrl+C is for the marker
    if done.returncode != 0:
        words = done.stderr.strip().splitlines() or ['exit status {}'.format(done.returncode)]
        raise _TooMuch('reading it takes more than {:g} GB of memory or {:g} s, or failed '
                       '({})'.format(MEMORY / 1e9, COMPUTING, words[-1]))
    return json.loads(done.stdout)


def _unpack_class(path, folder):
    budget = Budget(CLASS)
    try:
        unpack(Path(path), Path(folder), budget)
    except Refused as problem:
        return str(problem)
    return budget.exceeded


def _read(student: str, paths: Sequence[str], names: List[str], folder: str, lab: Sequence[Any],
          package: str, name: str) -> Union[str, Dict[str, Any]]:
    place = Path(folder)
    copy = Submission(student, list(map(Path, paths)), names).lay_out(place)
    unread = list(dict.fromkeys(copy.unread))
    try:
        choice = find_node(place, NodeNames(*lab), package, name)
    except NotJudged as problem:    # the node may be in what was not read
        return ' '.join((unread or [str(problem)]) + copy.remarks)
    node = place / choice.path
    source, packages = source_of(node, place), packages_in(place, node)
    needs = needs_of(node, packages)
    if needs.lacking:
        return '{} imports {}, which neither the submission nor the marking machine has.'.format(
            choice.path, ' and '.join(needs.lacking))
    return asdict(Reading(
        digest(place), copy.remarks + choice.remarks + unread, choice.look_at, choice.path,
        str(source.relative_to(place)), *name_in(source / MANIFEST),
        {each: str(packages[each].relative_to(place)) for each in needs.packages
         if each in packages}, needs.given, needs.unused))
