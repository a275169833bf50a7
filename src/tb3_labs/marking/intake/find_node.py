"""Finds the file of a submission that is the node of a lab.

A repository of a whole course may have several files with the same name. A file is chosen by its
package, by the signs that it is the node, and by its name. A file in a folder of old files is
chosen last.
If the chosen file only defines a class, the file that starts the class is the node.

The files are only read.
"""
import os
import re
import shlex
from pathlib import Path
from typing import List, NamedTuple, Tuple

from tb3_labs.marking.intake.archives import NotJudged, files_in, shortened
from tb3_labs.marking.intake.imports import LARGEST_PROGRAM, is_main_program, programs_of
from tb3_labs.marking.intake.packages import (
    FOLDERS, MANIFEST, is_aside, name_in, package_folder, source_of)
from tb3_labs.marking.names import LAB_NODES, NodeNames

#: A call of the reset service. The service's name is in quotes or in a variable.
RESET_CALL = r'\b{}\(\s*(?:name\s*=\s*)?([\'"][\w/~]*(pose|reset)|[^\s\'"])'
#: Two candidates are alike if this number of their first fields is equal.
COMPARED_RANKS = 4
#: Each relay script of catkin has this text. A relay starts a file on the student's machine.
RELAY_TEXT = b'generated from catkin/cmake/template'


class Choice(NamedTuple):
    """The file that is chosen as the node."""

    path: str
    remarks: List[str]      # for the student, if the choice was not clear
    findings: List[str]     # for the instructor, if another file may be the node


class _Candidate(NamedTuple):
    """A file that may be the node. The smallest candidate, compared as a tuple, is chosen."""

    aside: bool             # is the file in a folder of old or copied files?
    package: int            # 0 for the usual package; see _package_rank
    signs: int              # the number of missing signs; see _signs
    name: int               # index in the usual names; len(names) for another name
    folder: int             # index in FOLDERS; len(FOLDERS) for another folder
    depth: int
    path: str
    found_signs: Tuple[bool, ...]       # see _signs
    text: str


def find_node(folder: Path, lab: NodeNames, package: str = '', name: str = '') -> Choice:
    """Returns the Choice of the file below `folder` that is the node of a lab.

    A file can be the node if it has a usual name, or if it has the handout's names of class and
    node. It can also be the node if it listens to the lab's topic, and does not have the usual name
    of another lab's node. If `package` or `name` is given, the file must have it. `name` may also
    be a path, as printed for the instructor.

    Raises ``NotJudged`` if no file can be the node.
    """
    packages = (package,) if package else lab.packages
    names = (os.path.basename(name),) if name else lab.files
    handed_in = files_in(folder)
    package_of = {path: package_folder(path, folder) for path in handed_in if _is_program(path)}
    own_names = {found: _own_names(found, folder) for found in set(package_of.values())}
    programs = sorted(
        _candidate(lab, str(path.relative_to(folder)), own_names[found],
                   path.read_bytes().decode(errors='replace'), packages, names)
        for path, found in package_of.items())
    found = [each for each in programs
             if (not package or each.package == 0) and _can_be_the_node(each, names, name)
             and ('/' not in name or each.path == os.path.normpath(name))]
    if not found:
        paths = sorted(each.path for each in programs)
        raise NotJudged('There is no {}{}, and no other file does what it should. {}'.format(
            name or ' or '.join(names), f' in a package {package}' if package else '',
            f'Python files that were found (--type chooses one of them): {shortened(paths)}.'
            if paths else 'No Python file was found. Handed in: {}.'.format(
                shortened([str(path.relative_to(folder)) for path in handed_in]) or 'nothing')))
    start = None if name else _starting_program(found[0], programs, folder)
    if start is None:
        return Choice(found[0].path, *_remarks_and_findings(found, names))
    found = [each for each in found if each.path != start.path]
    _, findings = _remarks_and_findings(found, names)
    return Choice(start.path, [f'Judged was {start.path}, which starts {found[0].path}.'], findings)


def _starting_program(module, programs, folder):
    """Returns the first program that imports and starts `module`, and is in the same package.
    Returns None if there is no such program, or if `module` itself starts."""
    if is_main_program(module.text):
        return None
    path = folder / module.path
    package = source_of(path, folder)
    for each in programs:
        script = folder / each.path
        if (each.aside <= module.aside and package in script.parents and is_main_program(each.text)
                and path in programs_of(script, package)):
            return each
    return None


def _remarks_and_findings(found, names):
    """Returns (remarks, findings) on the choice of the first candidate. Each of the two lists has
    at most one sentence."""
    best, *others = found
    if not others:
        return [] if best.name < len(names) else [
            f"There is no {' or '.join(names)}; judged was {best.path}."], []
    remark = '{} files can be the node; judged was {}. The others: {}.'.format(
        len(found), best.path, shortened([each.path for each in others]))
    # another file may be the node if it is as likely, or has the usual name or the usual package
    doubtful = [each for each in others if each.text != best.text and (
        each[:COMPARED_RANKS] == best[:COMPARED_RANKS]
        or each[:2] == best[:2] and each.name < best.name == len(names)
        or each.package < 2 <= best.package)]
    if not doubtful:
        return [remark], []
    other = doubtful[-1].path if '/' in doubtful[-1].path else './' + doubtful[-1].path
    return [remark], [f'{remark} --type {shlex.quote(other)} chooses another one, with --only and '
                      "the student's name."]


def _is_program(path):
    if path.stat().st_size > LARGEST_PROGRAM:
        return False
    begin = path.read_bytes()[:300]
    return RELAY_TEXT not in begin and (
        path.suffix.lower() == '.py' or not path.suffix and b'python' in begin[:80])


def _own_names(package, folder):
    """Returns ([name in package.xml, name of the folder], the number of folders from `folder` to
    the package). Returns ([], 0) if `package` is None."""
    if package is None:
        return [], 0
    places = package.relative_to(folder).parts
    return [name_in(package / MANIFEST)[0], *places[-1:]], len(places)


def _candidate(lab, path, package, text, packages, names):
    *folders, name = path.lower().split('/')
    package_names, depth = package
    own_names, outer_names = package_names + folders[depth:], folders[:depth]
    found_signs = _signs(lab, text)
    lower = [usual.lower() for usual in names]
    return _Candidate(
        is_aside(path), min(_package_rank(usual, own_names, outer_names) for usual in packages),
        found_signs.count(False),
        lower.index(name) if name in lower else len(names),
        FOLDERS.index(folders[-1]) if folders and folders[-1] in FOLDERS else len(FOLDERS),
        len(folders), path, found_signs, text)


def _package_rank(usual, own_names, outer_names):
    """Returns 0 if the package has the `usual` name, 1 if the usual name is a part of its name, 2
    if a folder around the package has the usual name, else 3."""
    own_names = list(map(_normalized, own_names))
    if _normalized(usual) in own_names:
        return 0
    # my_lab2 and Lab2-main have the name lab2, but lab20 does not
    has_name = re.compile(re.escape(_normalized(usual)) + r'(?!\d)').search
    if any(map(has_name, own_names)):
        return 1
    return 2 if any(map(has_name, map(_normalized, outer_names))) else 3


def _normalized(name):
    """Returns a name in small letters, with a number directly behind its word: Lab_02 becomes
    lab2."""
    return re.sub(r'(?<=[a-z])[ _.-]*0*(?=\d)', '', name.lower())


def _signs(lab, text):
    """Returns a bool for each sign that a program is the node of a lab. The program listens to the
    lab's topic, has the handout's class, has the handout's name of the node, and has each of the
    lab's `uses`."""
    code = '\n'.join(line for line in text.splitlines() if not line.lstrip().startswith('#'))
    topic = r'[\'"]/?(\w+/)*{}[\'"]'
    return tuple(bool(re.search(pattern, code, re.MULTILINE)) for pattern in (
        r'Subscriber\(\s*(name\s*=\s*)?' + topic.format(lab.sensors[0]),
        rf'^[ \t]*class\s+{lab.class_name}\b',
        r'init_node\(\s*(name\s*=\s*)?[\'"]{}[\'"]'.format(lab.node_name),
        *(RESET_CALL.format(use[:-1]) if use.endswith('(') else topic.format(use)
          for use in lab.uses)))


def _can_be_the_node(candidate, names, name):
    listens, has_class, has_node_name, *_ = candidate.found_signs
    # a node of another lab may listen to the same topic
    is_other = any(os.path.basename(candidate.path) in other.files for other in LAB_NODES.values())
    return candidate.name < len(names) or not name and (
        listens + has_class + has_node_name >= 2 or listens and not is_other)
