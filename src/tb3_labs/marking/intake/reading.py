"""Reads a submission: it is copied, its node is chosen, and the needs of the node are found.

All this happens in a process of its own within limits, see limited.py: a file may be made so that
its reader needs all memory.
"""
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Dict, List, Sequence

from tb3_labs.marking.intake import limited
from tb3_labs.marking.intake.imports import needs_of
from tb3_labs.marking.intake.submissions import CLASS, Budget, Refused, Submission, unpack
from tb3_labs.marking.lab_names import NodeNames
from tb3_labs.marking.intake.packages import (
    MANIFEST, NoNode, digest, find_node, name_in, packages_in, source_of)


@dataclass
class Reading:
    """What was handed in. Paths are relative to the folder of the copy."""

    digest: str = ''                # of all files of the copy
    remarks: List[str] = field(default_factory=list)    # sentences for the student
    look_at: List[str] = field(default_factory=list)    # sentences for the instructor
    problem: str = ''               # why there is no node, a sentence; '' if there is one
    node: str = ''                  # its file
    package: str = ''               # the folder of its package
    name: str = ''                  # the name in the package's package.xml; '' if it has none
    bad_name: str = ''              # a sentence on a package.xml without a valid name
    packages: Dict[str, str] = field(default_factory=dict)  # the needed ones: name -> folder
    given: List[str] = field(default_factory=list)      # see imports.Needs
    unused: List[str] = field(default_factory=list)
    lacking: List[str] = field(default_factory=list)


def read(submission: Submission, folder: Path, lab: NodeNames, package: str = '',
         name: str = '') -> Reading:
    """The Reading of a submission, copied into `folder`, which is made. `package`, `name`: of the
    node, if given."""
    try:
        return Reading(**limited.call(
            _read, submission.student, list(map(str, submission.paths)), submission.names,
            str(folder), lab, package, name))
    except limited.TooMuch as problem:
        return Reading(problem='It cannot be read: {}.'.format(problem))


def unpack_class(path: Path, folder: Path) -> None:
    """Unpack the zip file of a class. ``Refused`` if it must not be."""
    try:
        problem = limited.call(_unpack_class, str(path), str(folder))
    except limited.TooMuch as problem_of_it:
        problem = 'The zip file cannot be unpacked: {}.'.format(problem_of_it)
    if problem:
        raise Refused(problem)


# -- in the process of its own

def _unpack_class(path, folder):
    budget = Budget(CLASS)
    try:
        unpack(Path(path), Path(folder), budget)
    except Refused as problem:
        return str(problem)
    return budget.exceeded


def _read(student: str, paths: Sequence[str], names: List[str], folder: str, lab: Sequence[Any],
          package: str, name: str) -> Dict[str, Any]:
    place = Path(folder)
    copy = Submission(student, list(map(Path, paths)), names).lay_out(place)
    reading = Reading(digest(place), copy.remarks)
    unread = list(dict.fromkeys(copy.unread))
    try:
        _find(reading, place, NodeNames(*lab), package, name)
        reading.remarks += unread
    except NoNode as problem:       # the node may be in what was not read
        reading.problem = ' '.join(unread) or str(problem)
    return asdict(reading)


def _find(reading, folder, lab, package, name):
    choice = find_node(folder, lab, package, name)
    reading.remarks += choice.remarks
    reading.look_at += choice.look_at
    node = folder / choice.path
    source, packages = source_of(node, folder), packages_in(folder, node)
    reading.node, reading.package = choice.path, str(source.relative_to(folder))
    reading.name, reading.bad_name = name_in(source / MANIFEST)
    needs = needs_of(node, packages)
    reading.packages = {each: str(packages[each].relative_to(folder)) for each in needs.packages
                        if each in packages}
    reading.given, reading.unused, reading.lacking = needs.given, needs.unused, needs.lacking
