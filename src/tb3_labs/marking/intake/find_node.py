"""Finds the node of a lab among the files of a submission.

A repository of a whole course may have several files with the same name. The choice depends on a
file's package, on signs of the node in the file, and on the file's name. A file in a folder of old
files is chosen only if no other file can be the node. If the chosen file only defines a class, the
file that starts the class is the node.

This module only reads the files.
"""
import os
import re
import shlex
from functools import lru_cache
from pathlib import Path
from typing import List, NamedTuple, Tuple

from tb3_labs.marking.intake.archives import UNPACKED_SUFFIX, NotJudged, files_in, shortened
from tb3_labs.marking.intake.imports import MAX_PROGRAM_BYTES, programs_of, read_program
from tb3_labs.marking.intake.packages import (
    NODE_FOLDERS, is_old_or_copy, node_package, package_folder, package_name)
from tb3_labs.marking.student_nodes import LAB_NODES, NodeNames

#: A call of the reset service. The service's name is in quotes or in a variable.
RESET_CALL = r'\b{}\(\s*(?:name\s*=\s*)?([\'"][\w/~]*(pose|reset)|[^\s\'"])'
COMPARED_FIELDS = 4     # two candidates are alike if their first fields are equal
#: The values of `package_rank` are these places of a package's usual name, the best first.
SAME_NAME, PART_OF_NAME, OUTER_FOLDER, NOWHERE = range(4)
#: The instructor reads this text if no file can be the node.
UNPACKING_RULES = 'Only zip files are unpacked, and none in others. Folders such as build, ' \
    'devel, install, logs and venv are left out.'


class ChosenNode(NamedTuple):
    """The file that is chosen as the node."""

    path: str
    remarks: List[str]      # for the student, if the choice was not clear
    findings: List[str]     # for the instructor, if another file may be the node


class _Candidate(NamedTuple):
    """A program. Candidates for the node are compared as tuples, and the smallest is chosen."""

    is_old: bool            # is the file in a folder of old or copied files?
    package_rank: int       # see _package_rank
    missing_signs: int      # how many signs of the node are missing; see _signs
    name_rank: int          # index of the file's name in the usual names; see _rank
    is_outside_zip: bool    # was the file handed in outside of a zip file, maybe without modules?
    folder_rank: int        # index of the file's folder in NODE_FOLDERS; see _rank
    depth: int
    path: str
    found_signs: Tuple[bool, ...]       # see _signs
    text: str


def find_node(folder: Path, lab: NodeNames, chosen_package: str = '', chosen_file: str = ''
              ) -> ChosenNode:
    """Returns the ChosenNode of a lab's node among the files below `folder`.

    A file can be the node if its name is usual, or if its class and its ROS node have the names of
    the handout. A file that listens to the lab's topic can also be the node, unless the file
    has the usual name of another lab's node. If `chosen_package` or `chosen_file` is given, the
    file must have this package or name. `chosen_file` may also be a path in `folder`.

    Raises ``NotJudged`` if no file can be the node.
    """
    usual_packages = (chosen_package,) if chosen_package else lab.packages
    usual_files = (os.path.basename(chosen_file),) if chosen_file else lab.files
    files = files_in(folder)
    program_files = [file for file in files if _is_program(file)]
    programs = sorted(_candidate(lab, file, folder, usual_packages=usual_packages,
                                 usual_files=usual_files) for file in program_files)
    candidates = [program for program in programs
                  if _can_be_the_node(program, usual_files, chosen_file)]
    if chosen_package:
        candidates = [program for program in candidates if program.package_rank == SAME_NAME]
    if '/' in chosen_file:
        path = os.path.normpath(chosen_file)
        candidates = [program for program in candidates if program.path == path]
    if not candidates:
        missing = chosen_file if chosen_file else ' or '.join(usual_files)
        if chosen_package:
            missing += f' in a package {chosen_package}'
        listed = dict.fromkeys([*program_files, *files])    # the programs first
        listing = shortened([str(file.relative_to(folder)) for file in listed]) or 'nothing'
        raise NotJudged(f'There is no {missing}, and no other file does what it should. Handed in '
                        f'(--type chooses a file): {listing}. {UNPACKING_RULES}')
    starter = None if chosen_file else _starting_program(candidates[0], programs, folder)
    if starter is None:
        return ChosenNode(candidates[0].path, *_remarks_and_findings(candidates, usual_files))
    candidates = [program for program in candidates if program.path != starter.path]
    _, findings = _remarks_and_findings(candidates, usual_files)
    remark = f'Judged was {starter.path}, which starts {candidates[0].path}.'
    return ChosenNode(starter.path, [remark], findings)


def _starting_program(module, programs, folder):
    """Returns the first program that imports and starts `module`, and is in the same package.
    Returns None if there is no such program, or if `module` itself does more than define names."""
    path = folder / module.path
    if read_program(path).runs_code_on_import:
        return None
    package = node_package(path, folder)
    for program in programs:
        script = folder / program.path
        may_start_module = package in script.parents and (module.is_old or not program.is_old)
        if may_start_module and read_program(script).runs_code_on_import:
            if path in programs_of(script, package):
                return program
    return None


def _remarks_and_findings(candidates, usual_files):
    best, *others = candidates
    if not others:
        if best.name_rank < len(usual_files):
            return [], []
        return [f"There is no {' or '.join(usual_files)}; judged was {best.path}."], []
    remark = '{} files can be the node; judged was {}. The others: {}.'.format(
        len(candidates), best.path, shortened([other.path for other in others]))
    doubtful = [other.path for other in others if _is_doubtful(best, other, usual_files)]
    if not doubtful:
        return [remark], []
    path = doubtful[0] if '/' in doubtful[0] else './' + doubtful[0]
    return [remark], [f'{remark} --type {shlex.quote(path)} chooses another one, with --only and '
                      "the student's name."]


def _is_doubtful(best, other, usual_files):
    if other.text == best.text:
        return False
    is_alike = other[:COMPARED_FIELDS] == best[:COMPARED_FIELDS]
    only_other_has_usual_name = other.name_rank < len(usual_files) == best.name_rank
    in_same_place = (other.is_old, other.package_rank) == (best.is_old, best.package_rank)
    has_better_name = only_other_has_usual_name and in_same_place
    has_better_package = other.package_rank <= PART_OF_NAME < best.package_rank
    is_elsewhere = other.is_outside_zip != best.is_outside_zip
    return is_alike or has_better_name or has_better_package or is_elsewhere


def _is_program(path):
    if path.stat().st_size > MAX_PROGRAM_BYTES:
        return False
    if path.suffix:
        return path.suffix.lower() == '.py'
    return b'python' in path.read_bytes()[:80]


@lru_cache(maxsize=None)        # the same package has many files
def _package_names(package, folder):
    """Returns (the names in package.xml and of the package's folder, the depth of this folder)."""
    if package is None:
        return [], 0
    folders = package.relative_to(folder).parts
    return [package_name(package), *folders[-1:]], len(folders)


def _candidate(lab, file, folder, usual_packages, usual_files):
    path = str(file.relative_to(folder))
    text = file.read_bytes().decode(errors='replace')
    *folders, name = path.lower().split('/')
    package_names, package_depth = _package_names(package_folder(file, folder), folder)
    own_names, outer_names = package_names + folders[package_depth:], folders[:package_depth]
    found_signs = _signs(lab, text)
    return _Candidate(
        is_old=is_old_or_copy(path),
        package_rank=min(_package_rank(usual, own_names, outer_names) for usual in usual_packages),
        missing_signs=found_signs.count(False),
        name_rank=_rank(name, [usual.lower() for usual in usual_files]),
        is_outside_zip=UNPACKED_SUFFIX + '/' not in path,
        folder_rank=_rank(''.join(folders[-1:]), NODE_FOLDERS),
        depth=len(folders), path=path, found_signs=found_signs, text=text)


def _rank(name, usual_names):
    return usual_names.index(name) if name in usual_names else len(usual_names)


def _package_rank(usual, own_names, outer_names):
    """Returns SAME_NAME if the package has the name `usual`, PART_OF_NAME if its name contains
    `usual`, OUTER_FOLDER if the name of an outer folder contains `usual`, and else NOWHERE."""
    own_names = list(map(_normalized, own_names))
    if _normalized(usual) in own_names:
        return SAME_NAME
    # my_lab2 and Lab2-main have the name lab2, but lab20 does not
    has_name = re.compile(re.escape(_normalized(usual)) + r'(?!\d)').search
    if any(map(has_name, own_names)):
        return PART_OF_NAME
    is_outside = any(map(has_name, map(_normalized, outer_names)))
    return OUTER_FOLDER if is_outside else NOWHERE


def _normalized(name):
    """Returns lab2 for Lab_02 and lab-2."""
    return re.sub(r'(?<=[a-z])[ _.-]*0*(?=\d)', '', name.lower())


def _signs(lab, text):
    """Returns a bool for each sign of the lab's node. The signs are the subscription to the lab's
    topic, the handout's class, the handout's name of the node, and the lab's `other_signs`."""
    code = '\n'.join(line for line in text.splitlines() if not line.lstrip().startswith('#'))
    topic = r'[\'"]/?(\w+/)*{}[\'"]'
    patterns = [r'Subscriber\(\s*(name\s*=\s*)?' + topic.format(lab.needed_topics[0]),
                rf'^[ \t]*class\s+{lab.class_name}\b',
                r'init_node\(\s*(name\s*=\s*)?[\'"]{}[\'"]'.format(lab.node_name)]
    for sign in lab.other_signs:
        is_call = sign.endswith('(')
        patterns.append(RESET_CALL.format(sign[:-1]) if is_call else topic.format(sign))
    return tuple(bool(re.search(pattern, code, re.MULTILINE)) for pattern in patterns)


def _can_be_the_node(candidate, usual_files, chosen_file):
    if candidate.name_rank < len(usual_files):
        return True
    if chosen_file:
        return False
    listens, has_class, has_node_name, *_ = candidate.found_signs
    # a node of another lab may listen to the same topic
    file = os.path.basename(candidate.path)
    has_name_of_a_lab = any(file in lab.files for lab in LAB_NODES.values())
    has_two_signs = [listens, has_class, has_node_name].count(True) >= 2
    return has_two_signs or (listens and not has_name_of_a_lab)
