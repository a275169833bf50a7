"""Finds the file of a submission that is the node of a lab.

A repository of a whole course may have several files with the same name. A file in a folder of old
files is chosen last. Otherwise a file is chosen by its package, by its name, and by what it does.

All files of a submission are only read, as texts.
"""
import os
import re
import shlex
from pathlib import Path
from typing import List, NamedTuple, Tuple

from tb3_labs.marking.intake.archives import NotJudged, files_in, shortened
from tb3_labs.marking.intake.packages import FOLDERS, MANIFEST, is_aside, name_in, package_folder
from tb3_labs.marking.names import LAB_NODES, NodeNames

LISTENS_TO = 'listens to '
#: Two candidates are alike if their first ranks, so many, are equal.
COMPARED_RANKS = 4
#: This text is in the relays that catkin makes. A relay starts a file of the student's machine.
RELAY_TEXT = b'generated from catkin/cmake/template'
#: A larger file is not a program [bytes].
LARGEST_PROGRAM = 1000000


class Choice(NamedTuple):
    """The file that is chosen as the node."""

    path: str
    remarks: List[str]      # the reason of the choice, for the student
    findings: List[str]     # for the instructor, if the choice was by chance


class _Candidate(NamedTuple):
    """A file that may be the node, and its ranks. They are compared in this order, and the file
    with the smallest ranks is chosen."""

    aside: bool             # is it in a folder of old or copied files?
    package: int            # 0: a usual package; 1: a name that begins like it; 2: another name
    name: int               # place among the usual names; len(names) if it has another name
    signs: int              # the number of signs of the node that are missing
    folder: int             # place among the usual folders
    depth: int
    path: str
    sign_texts: Tuple[str, ...]   # the signs that were found
    text: str


def find_node(folder: Path, lab: NodeNames, package: str = '', name: str = '') -> Choice:
    """Returns the Choice of the file below `folder` that is the node of a lab.

    A file can be the node in three cases: it has a usual name; it listens to the lab's topic, and
    does not have the usual name of another lab's node; or it has the handout's names of class and
    node. If `package` or `name` is given, the file must have that package or name; `name` may be a
    path, as a line prints it. Raises ``NotJudged`` if no file can be the node.
    """
    packages = (package,) if package else lab.packages
    names = (os.path.basename(name),) if name else lab.files
    handed_in = files_in(folder)
    package_of = {path: package_folder(path, folder) for path in handed_in if _is_program(path)}
    package_names = {found: name_in(found / MANIFEST)[0] if found else ''
                     for found in set(package_of.values())}
    programs = sorted(
        _candidate(lab, str(path.relative_to(folder)), package_names[found],
                   path.read_bytes().decode(errors='replace'), packages, names)
        for path, found in package_of.items())
    found = [each for each in programs
             if (not package or each.package == 0) and _can_be_the_node(each, names, name)
             and ('/' not in name or each.path == os.path.normpath(name))]
    if not found:
        raise NotJudged('There is no {}{}, and no other file does what it should. {}'.format(
            name or ' or '.join(names), ' in a package {}'.format(package) if package else '',
            _what_was_found(sorted(each.path for each in programs),
                            [str(path.relative_to(folder)) for path in handed_in])))
    return Choice(found[0].path, _remarks(found, packages, names), _advice(found))


def _advice(found):
    """Returns a sentence for the instructor if another file is as likely the node; else []."""
    best, *alike = [each for each in found
                    if each[:COMPARED_RANKS] == found[0][:COMPARED_RANKS]]
    if all(each.text == best.text for each in alike):
        return []
    other = alike[-1].path if '/' in alike[-1].path else './' + alike[-1].path
    return ['Judged was {}. It is as likely the node as {}, and they differ: --type {} '
            "chooses another one, with --only and the student's name.".format(
                best.path, shortened([each.path for each in alike]), shlex.quote(other))]


def _is_program(path):
    if path.stat().st_size > LARGEST_PROGRAM:
        return False
    begin = path.read_bytes()[:300]
    return RELAY_TEXT not in begin and (
        path.suffix == '.py' or not path.suffix and b'python' in begin[:80])


def _candidate(lab, path, package, text, packages, names):
    *folders, name = path.lower().split('/')
    sign_texts = _signs(lab, text)
    lower = [usual.lower() for usual in names]
    return _Candidate(
        is_aside(path),
        min(_package_rank(usual.lower(), [package.lower()] + folders) for usual in packages),
        lower.index(name) if name in lower else len(names), 3 - len(sign_texts),
        FOLDERS.index(folders[-1]) if folders and folders[-1] in FOLDERS else len(FOLDERS),
        len(folders), path, sign_texts, text)


def _package_rank(usual, names):
    if usual in names:
        return 0
    # lab2_final and Lab2-main begin like lab2, but lab20 does not
    return 1 if any(re.match(re.escape(usual) + r'(?![a-z0-9])', name) for name in names) else 2


def _signs(lab, text):
    """Returns the signs of the lab's node in a program, as clauses such as 'listens to imu'."""
    code = '\n'.join(line for line in text.splitlines() if not line.lstrip().startswith('#'))
    return tuple(sign for pattern, sign in (
        (r'Subscriber\(\s*(name\s*=\s*)?[\'"]/?(\w+/)*{}[\'"]'.format(lab.sensors[0]),
         LISTENS_TO + lab.sensors[0]),
        (rf'^[ \t]*class\s+{lab.class_name}\b', 'has the class ' + lab.class_name),
        (r'init_node\(\s*(name\s*=\s*)?[\'"]{}[\'"]'.format(lab.node_name),
         'is the node ' + lab.node_name),
    ) if re.search(pattern, code, re.MULTILINE))


def _can_be_the_node(candidate, names, name):
    signs = candidate.sign_texts
    # a node of another lab may listen to the same topic
    is_other = any(os.path.basename(candidate.path) in other.files for other in LAB_NODES.values())
    listens = any(sign.startswith(LISTENS_TO) for sign in signs)
    return candidate.name < len(names) or not name and (
        len(signs) >= 2 or listens and not is_other)


def _remarks(found, packages, names):
    best, *others = found
    signs = ' and '.join(best.sign_texts)
    if not others:
        return [] if best.name < len(names) else [
            f"There is no {' or '.join(names)}; judged was {best.path}, which {signs}."]
    why = 'it comes first'
    for rank, reason in enumerate((
            'the others were put aside', 'it is in the package ' + ' or '.join(packages),
            'it has the usual name', 'it ' + signs)):
        if best[rank] != others[0][rank]:
            why = reason
            break
    if best.package == 2 and any(packages):
        why += f" (there is no package {' or '.join(packages)})"
    return ['{} files can be the node; judged was {}, because {}. The others: {}.'.format(
        len(found), best.path, why, shortened([other.path for other in others]))]


def _what_was_found(programs, handed_in):
    if programs:
        return ('Python files that were found (--type chooses one of them): {}.'
                .format(shortened(programs)))
    return 'No Python file was found at all. ' + (
        f'Handed in: {shortened(handed_in)}.' if handed_in else
        'Nothing that a person writes was handed in.')
