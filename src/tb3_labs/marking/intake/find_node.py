"""Finds the node of a lab among the files of a submission.

The repository of a whole course may contain several files with the same name. The choice depends on
a file's package, on signs of the node in the file, and on the file's name. A file that is old or a
copy is chosen only if no other file can be the node. If the chosen file only defines a class, the
node is the file that starts the class.
"""
import os
import re
import shlex
from functools import lru_cache
from pathlib import Path
from typing import List, NamedTuple, Tuple

from tb3_labs.marking.intake.archives import UNPACKED_SUFFIX, NotJudged, files_in, short_list
from tb3_labs.marking.intake.imports import MAX_PROGRAM_BYTES, programs_of, read_program
from tb3_labs.marking.intake.packages import (
    NODE_FOLDERS, is_old_or_copy, node_package, package_folder, package_name)
from tb3_labs.marking.student_nodes import LAB_NODES, NodeNames

#: Matches a call of the reset service. The called function, such as ServiceProxy, replaces the {}.
#: The service's name is in quotes or in a variable.
RESET_CALL = r'\b{}\(\s*(?:name\s*=\s*)?([\'"][\w/~]*(pose|reset)|[^\s\'"])'
# `package_match` has one of these values, which says where a package's usual name was found.
SAME_NAME = 0           # the usual name is the package's name
PART_OF_NAME = 1        # the package's name contains the usual name
OUTER_FOLDER = 2        # the name of an outer folder contains the usual name
NOWHERE = 3
QualityKey = Tuple[bool, int, int, int]     # see _Program.quality_key
UNPACKING_RULES = ('Only zip files are unpacked, and none in others. Folders such as build, devel, '
                   'install, logs and venv are left out.')


class ChosenNode(NamedTuple):
    """The file that is chosen as the node."""

    path: str
    remarks: List[str]      # for the student, if the choice was not clear
    findings: List[str]     # for the instructor, if another file may be the node


class _Program(NamedTuple):
    """A program of the submission, and how well it matches the node of the lab."""

    path: str
    text: str
    is_old: bool            # the file, or one of its folders, is old or a copy
    package_match: int      # a value such as SAME_NAME
    found_signs: Tuple[bool, ...]       # see _found_signs
    name_position: int      # the position of the file's name in the usual names; see _position
    has_usual_name: bool    # the file's name is a usual name
    is_outside_zip: bool    # the file was handed in without a zip file, maybe without modules
    folder_position: int    # the position of the file's folder in NODE_FOLDERS; see _position

    @property
    def quality_key(self) -> QualityKey:
        """A key that is least for the program that matches the node best."""
        missing_signs = self.found_signs.count(False)
        return self.is_old, self.package_match, missing_signs, self.name_position

    @property
    def sort_key(self) -> Tuple[QualityKey, bool, int, int, str]:
        """A key that sorts the best program first. If two are equally good, their places decide."""
        depth = self.path.count('/')
        return self.quality_key, self.is_outside_zip, self.folder_position, depth, self.path


def find_node(folder: Path, node_names: NodeNames, chosen_package: str = '',
              chosen_file: str = '') -> ChosenNode:
    """Returns the ChosenNode of a lab's node among the files below `folder`.

    A file can be the node if its name is usual, or if two of the first three signs of
    `_found_signs` are in the file. A file with only the first sign can be the node if no lab's node
    usually has the file's name. If `chosen_package` or `chosen_file` is given, the file must have
    this package or name. `chosen_file` may also be a path in `folder`.

    Raises ``NotJudged`` if no file can be the node.
    """
    if chosen_package:
        node_names = node_names._replace(packages=(chosen_package,))
    if chosen_file:
        node_names = node_names._replace(files=(os.path.basename(chosen_file),))
    files = files_in(folder)
    program_files = [file for file in files if _is_program(file, os.path.basename(chosen_file))]
    programs = [_program_in_file(file, folder, node_names) for file in program_files]
    programs.sort(key=lambda program: program.sort_key)
    candidates = [program for program in programs
                  if _can_be_the_node(program, chosen_package, chosen_file)]
    if not candidates:
        missing = chosen_file or ' or '.join(node_names.files)
        if chosen_package:
            missing += f' in a package {chosen_package}'
        sorted_files = dict.fromkeys([*program_files, *files])    # the programs first
        listing = short_list([str(file.relative_to(folder)) for file in sorted_files]) or 'nothing'
        advice = _advice('FILE', 'a file') if files else ''
        raise NotJudged(f'There is no {missing}, and no other file does what it should. Handed in: '
                        f'{listing}. {UNPACKING_RULES}', advice)

    best = candidates[0]
    starter = None if chosen_file else _starting_program(best, programs, folder)
    candidates = [program for program in candidates if program is not starter]
    remarks, findings = _remarks_and_findings(candidates, node_names)
    if starter is None:
        return ChosenNode(best.path, remarks, findings)
    remark = f'Judged was {starter.path}, which starts {best.path}.'
    return ChosenNode(starter.path, [remark], findings)


def _starting_program(module, programs, folder):
    """Returns the first program of the same package that imports and starts `module`. Returns None
    if there is no such program, or if `module` itself does more than define names."""
    module_path = folder / module.path
    if read_program(module_path).runs_code_on_import:
        return None
    package = node_package(module_path, folder)
    for program in programs:
        path = folder / program.path
        is_outdated = program.is_old and not module.is_old
        if package not in path.parents or is_outdated:
            continue
        if read_program(path).runs_code_on_import and module_path in programs_of(path, package):
            return program
    return None


def _remarks_and_findings(candidates, node_names):
    best, *others = candidates
    if not others:
        if best.has_usual_name:
            return [], []
        return [f"There is no {' or '.join(node_names.files)}; judged was {best.path}."], []
    remark = (f'{len(candidates)} files can be the node; judged was {best.path}. The others: '
              f'{short_list([other.path for other in others])}.')
    doubtful_paths = [other.path for other in others if _is_doubtful(best, other)]
    if not doubtful_paths:
        return [remark], []
    # without a slash, --type would take the path for a name
    path = doubtful_paths[0] if '/' in doubtful_paths[0] else './' + doubtful_paths[0]
    return [remark], [f"{remark} {_advice(shlex.quote(path), 'another one')}"]


def _advice(type_option, chosen):
    return f"--type {type_option} chooses {chosen}, with --only and the student's name."


def _is_doubtful(best, other):
    """Returns True if the instructor should know that `other`, and not the chosen program `best`,
    may be the node."""
    if other.text == best.text:     # both files would get the same points
        return False
    if other.quality_key == best.quality_key or other.is_outside_zip != best.is_outside_zip:
        return True
    # `other` alone has a package with a usual name, and was not chosen because it is old
    if other.package_match <= PART_OF_NAME < best.package_match:
        return True
    # only the signs of the node, or the names of the files, decided between the two
    return other.is_old == best.is_old and other.package_match == best.package_match


def _is_program(path, chosen_name):
    if path.stat().st_size > MAX_PROGRAM_BYTES:
        return False
    if path.name == chosen_name:        # a person may choose a file such as node.txt
        return True
    if path.suffix:
        return path.suffix.lower() == '.py'
    return b'python' in path.read_bytes()[:80]      # in a line such as #!/usr/bin/env python3


@lru_cache(maxsize=None)        # a package has many files, but its package.xml is read once
def _package_names(package, folder):
    """Returns ([name in the package.xml, name of the package's folder], depth of this folder)."""
    if package is None:
        return [], 0
    folder_names = package.relative_to(folder).parts
    own_folder_if_any = folder_names[-1:]       # empty if the package is `folder` itself
    return [package_name(package), *own_folder_if_any], len(folder_names)


def _program_in_file(file, folder, node_names):
    path = file.relative_to(folder)
    text = file.read_bytes().decode(errors='replace')
    lower_path = Path(str(path).lower())
    usual_files = [usual.lower() for usual in node_names.files]
    folder_names = lower_path.parent.parts
    package_names, package_depth = _package_names(package_folder(file, folder), folder)
    outer_names, inner_names = folder_names[:package_depth], folder_names[package_depth:]
    own_names = [*package_names, *inner_names]
    package_match = min(_package_match(usual, own_names, outer_names)
                        for usual in node_names.packages)
    return _Program(
        path=str(path), text=text, is_old=is_old_or_copy(str(path)), package_match=package_match,
        found_signs=_found_signs(text, node_names),
        name_position=_position(lower_path.name, usual_files),
        has_usual_name=lower_path.name in usual_files,
        is_outside_zip=UNPACKED_SUFFIX + '/' not in str(path),
        folder_position=_position(lower_path.parent.name, NODE_FOLDERS))


def _position(name, usual_names):
    """Returns the index of `name` in `usual_names`, or a larger number if `name` is not there."""
    return usual_names.index(name) if name in usual_names else len(usual_names)


def _package_match(usual, own_names, outer_names):
    """Returns a value such as SAME_NAME, which says where the package name `usual` was found."""
    usual = _plain_name(usual)
    own_names = [_plain_name(name) for name in own_names]
    if usual in own_names:
        return SAME_NAME
    # my_lab2 and Lab2-main contain lab2, but lab20 does not
    pattern = re.compile(re.escape(usual) + r'(?!\d)')
    if any(pattern.search(name) for name in own_names):
        return PART_OF_NAME
    if any(pattern.search(_plain_name(name)) for name in outer_names):
        return OUTER_FOLDER
    return NOWHERE


def _plain_name(name):
    """Returns lab2 for Lab_02 and lab-2."""
    return re.sub(r'(?<=[a-z])[ _.-]*0*(?=\d)', '', name.lower())


def _found_signs(text, node_names):
    """Returns a bool for each sign of the lab's node. The signs are the subscription to the lab's
    topic, the handout's class, the handout's name of the node, and the `other_signs`."""
    code = '\n'.join(line for line in text.splitlines() if not line.lstrip().startswith('#'))
    quoted_topic = r'[\'"]/?(\w+/)*{}[\'"]'
    patterns = [r'Subscriber\(\s*(name\s*=\s*)?' + quoted_topic.format(node_names.needed_topics[0]),
                rf'^[ \t]*class\s+{node_names.class_name}\b',
                r'init_node\(\s*(name\s*=\s*)?[\'"]{}[\'"]'.format(node_names.node_name)]
    for sign in node_names.other_signs:
        if sign.endswith('('):
            patterns.append(RESET_CALL.format(sign.rstrip('(')))
        else:
            patterns.append(quoted_topic.format(sign))
    return tuple(bool(re.search(pattern, code, re.MULTILINE)) for pattern in patterns)


def _can_be_the_node(program, chosen_package, chosen_file):
    if chosen_package and program.package_match != SAME_NAME:
        return False
    if '/' in chosen_file and program.path != os.path.normpath(chosen_file):
        return False
    if chosen_file:
        return program.has_usual_name       # the only usual name is that of `chosen_file`
    if program.has_usual_name:
        return True
    listens, has_class, has_node_name, *_ = program.found_signs
    if [listens, has_class, has_node_name].count(True) >= 2:
        return True
    # a node of another lab may listen to the same topic
    file = os.path.basename(program.path)
    return listens and not any(file in names.files for names in LAB_NODES.values())
