"""Copies a submission, chooses its node, and finds its packages and the node's missing modules.

A separate process reads the submission, since a stranger's file may use all memory, or take hours
to read. If a limit ends that process, the marking goes on.
"""
import json
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any, Callable, Dict, List, NamedTuple, Sequence

from tb3_labs.marking.intake.archives import (
    IGNORED_PATHS, SUBMISSIONS_PER_CLASS_ZIP, NotJudged, UnpackLimits, digest, unpack)
from tb3_labs.marking.intake.find_node import find_node
from tb3_labs.marking.intake.imports import find_missing
from tb3_labs.marking.intake.packages import (
    MANIFEST, gather_definitions, name_in, own_name, packages_in, source_of)
from tb3_labs.marking.intake.submissions import Submission, copy_submission
from tb3_labs.marking.names import NodeNames

#: The limits of the process that reads a submission: memory [bytes], processor time [s].
MEMORY, COMPUTING = 10 ** 9, 120
#: This program calls a function of this file. Its input and its output are JSON.
PROGRAM = '''import json, sys
del sys.path[0]
name, arguments = json.load(sys.stdin)
from tb3_labs.marking.intake import read_submission
try:
    answer = getattr(read_submission, name)(*arguments), None
except read_submission.NotJudged as problem:
    answer = None, str(problem)
json.dump(answer, sys.stdout)
'''


class ParsedSubmission(NamedTuple):
    """A submission as it was read. Paths are relative to the folder of the copy."""

    digest: str                     # a hash of all files of the copy
    remarks: List[str]              # sentences for the student; prepare() adds sentences
    findings: List[str]             # sentences for the instructor; prepare() adds sentences
    node: str                       # the node's file
    package: str                    # the folder of the node's package
    name: str                       # the name in the package's package.xml; '' if it is not valid
    packages: Dict[str, str]        # name -> folder; the package nearest to the node is last
    substituted: Dict[str, List[str]]   # missing package -> files of the course's types for it
    unused: List[str]               # missing modules that the node imports and does not use


def read(submission: Submission, folder: Path, lab: NodeNames, package: str = '',
         name: str = '') -> ParsedSubmission:
    """Make `folder`, copy a submission into it, and read the copy. If `package` or `name` is given,
    the node has that package or name.

    Raises ``NotJudged`` if no file can be the node, or if the node uses a missing module.
    """
    files = {str(path): own_name for path, own_name in submission.files.items()}
    return ParsedSubmission(
        *_in_limited_process('It cannot be read', _read, files, str(folder), lab, package, name))


def unpack_class(path: Path, folder: Path) -> List[str]:
    """Unpack the zip file of a class. Returns remarks on files that are left out. Raises
    ``NotJudged`` if the file is not a zip file, exceeds a limit, or is not safe."""
    return _in_limited_process(
        'The zip file cannot be unpacked', _unpack_class, str(path), str(folder))


def _in_limited_process(failure: str, function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function of this file in a process with limits, and return its result. JSON transfers
    the arguments and the result. Raises ``NotJudged`` if the function raises this exception, or if
    the process ends without a result, usually because of a limit. In the second case the text
    begins with `failure`."""
    done = subprocess.run(
        ['prlimit', f'--as={MEMORY}:', f'--cpu={COMPUTING}', '--core=0',
         sys.executable, '-c', PROGRAM],
        input=json.dumps([function.__name__, arguments]),
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True,
        cwd='/',                    # python -c imports from this folder
        start_new_session=True)     # Ctrl+C must not end this process
    if done.returncode != 0:
        lines = done.stderr.strip().splitlines() or [f'exit status {done.returncode}']
        raise NotJudged('{}: reading it takes more than {:g} GB of memory or {:g} s, or failed '
                        '({}).'.format(failure, MEMORY / 1e9, COMPUTING, lines[-1]))
    result, refusal = json.loads(done.stdout)
    if refusal is not None:
        raise NotJudged(refusal)
    return result


# -- in the limited process

def _unpack_class(path, folder):
    limits = UnpackLimits(SUBMISSIONS_PER_CLASS_ZIP)
    remarks = unpack(Path(path), Path(folder), limits, IGNORED_PATHS)
    if limits.exceeded:
        raise NotJudged(limits.exceeded)
    return remarks


def _read(files: Dict[str, str], folder: str, lab: Sequence[Any], package: str,
          name: str) -> ParsedSubmission:
    copy = Path(folder)
    names = NodeNames(*lab)

    def has_node() -> bool:
        with suppress(NotJudged):
            return bool(find_node(copy, names, package, name))
        return False
    remarks, not_unpacked = copy_submission(
        {Path(path): own_name for path, own_name in files.items()}, copy, has_node)
    not_unpacked = list(dict.fromkeys(not_unpacked))
    try:
        path, why, findings = find_node(copy, names, package, name)
    except NotJudged as problem:    # the node may be in an archive that was not unpacked
        raise NotJudged(' '.join((not_unpacked or [str(problem)]) + remarks)) from None
    node = copy / path
    gather_definitions(copy)
    source = source_of(node, copy)
    packages = packages_in(copy, node)
    missing = find_missing(node, source, copy, packages)
    if any(module.split('.')[0] == 'rclpy' for module in missing.used):
        raise NotJudged(f'{path} is a node of ROS 2: it imports rclpy. The labs have ROS 1: rospy.')
    if missing.used:
        modules = ', '.join('{} ({})'.format(module, error.split(':')[0])
                            for module, error in sorted(missing.used.items()))
        raise NotJudged(
            f'{path} needs modules that do not work on the marking machine: {modules}.')
    for name, place in packages.items():
        if own_name(place) not in ('', name):
            remarks.append(f'The package {name} was not handed in: the types of '
                           f'{own_name(place)} stand in for its own.')
    package_name, bad_name = name_in(source / MANIFEST)
    remarks += why + not_unpacked
    if bad_name:
        remarks.append(bad_name)
    return ParsedSubmission(
        digest(copy), remarks, findings, path, str(source.relative_to(copy)), package_name,
        {name: str(place.relative_to(copy)) for name, place in packages.items()},
        missing.substituted, missing.unused)
