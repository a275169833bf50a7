"""Reads a submission: it is copied, its node is chosen, and the needs of the node are found.

All this happens in a process of its own within limits: a file of a stranger may be made so that
reading it takes all memory, or hours. Then that process ends, not the marking.
"""
import json
import subprocess
import sys
from pathlib import Path
from typing import Any, Callable, Dict, List, NamedTuple, Sequence

from tb3_labs.marking.intake.imports import needs_of
from tb3_labs.marking.intake.packages import (
    MANIFEST, NotJudged, digest, find_node, name_in, packages_in, source_of)
from tb3_labs.marking.intake.submissions import CLASS, Budget, Submission, unpack
from tb3_labs.marking.lab_names import NodeNames

#: The most that a call may use: memory [bytes], processor time [s].
MEMORY, COMPUTING = 10 ** 9, 120
PROGRAM = '''import json, sys
sys.path[:], name, arguments = json.load(sys.stdin)
from tb3_labs.marking.intake import reading
try:
    answer = getattr(reading, name)(*arguments), None
except reading.NotJudged as problem:
    answer = None, str(problem)
json.dump(answer, sys.stdout)
'''


class Reading(NamedTuple):
    """What was handed in. Paths are relative to the folder of the copy."""

    digest: str                     # of all files of the copy
    remarks: List[str]              # sentences for the student; later steps add theirs
    look_at: List[str]              # sentences for the instructor, as well
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
    return Reading(*_call('It cannot be read', _read, list(map(str, submission.paths)),
                          submission.names, str(folder), lab, package, name))


def unpack_class(path: Path, folder: Path) -> None:
    """Unpack the zip file of a class. ``NotJudged`` if it must not be."""
    _call('The zip file cannot be unpacked', _unpack_class, str(path), str(folder))


def _call(failure: str, function: Callable[..., Any], *arguments: Any) -> Any:
    """The result of a function of this file, in a process of its own. Arguments and result pass as
    JSON. ``NotJudged`` if the function raises it; or if there is no result, most likely at a limit:
    its text begins with `failure`."""
    done = subprocess.run(
        ['prlimit', '--as={}'.format(MEMORY), '--cpu={}'.format(COMPUTING), '--core=0',
         sys.executable, '-c', PROGRAM],
        input=json.dumps([sys.path, function.__name__, arguments]),
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True,
        cwd='/',                    # Python looks for modules in its folder
        start_new_session=True)     # Ctrl+C is for the marker
    if done.returncode != 0:
        words = done.stderr.strip().splitlines() or ['exit status {}'.format(done.returncode)]
        raise NotJudged('{}: reading it takes more than {:g} GB of memory or {:g} s, or failed '
                        '({}).'.format(failure, MEMORY / 1e9, COMPUTING, words[-1]))
    result, refusal = json.loads(done.stdout)
    if refusal is not None:
        raise NotJudged(refusal)
    return result


# -- in the process of its own

def _unpack_class(path, folder):
    budget = Budget(CLASS)
    unpack(Path(path), Path(folder), budget)
    if budget.exceeded:
        raise NotJudged(budget.exceeded)


def _read(paths: Sequence[str], names: List[str], folder: str, lab: Sequence[Any], package: str,
          name: str) -> Reading:
    place = Path(folder)
    remarks, unread = Submission('', list(map(Path, paths)), names).lay_out(place)
    unread = list(dict.fromkeys(unread))
    try:
        path, why, look_at = find_node(place, NodeNames(*lab), package, name)
    except NotJudged as problem:    # the node may be in what was not read
        raise NotJudged(' '.join((unread or [str(problem)]) + remarks)) from None
    node = place / path
    source, packages = source_of(node, place), packages_in(place, node)
    needs = needs_of(node, packages)
    if needs.lacking:
        raise NotJudged('{} imports {}, which neither the submission nor the marking machine has.'
                        .format(path, ' and '.join(needs.lacking)))
    return Reading(
        digest(place), remarks + why + unread, look_at, path, str(source.relative_to(place)),
        *name_in(source / MANIFEST),
        {each: str(packages[each].relative_to(place)) for each in needs.packages
         if each in packages}, needs.given, needs.unused)
