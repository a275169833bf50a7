"""The file of a submission that is the node of a lab.

A repository of a whole course has several files with the same name. A file that was put aside comes
last; then a file is chosen by its package, its name, and what it does.

Here all files of a submission are only read, as texts.
"""
import os
import re
import shlex
from functools import lru_cache
from pathlib import Path
from typing import List, NamedTuple, Tuple

from tb3_labs.marking.intake.archives import NotJudged, files_in, shortened
from tb3_labs.marking.intake.packages import FOLDERS, MANIFEST, is_aside, name_in, package_folder
from tb3_labs.marking.names import LAB_NODES, NodeNames

LISTENS_TO = 'listens to '
#: Candidates with this many equal ranks are alike.
ALIKE = 4
#: This text is in the relays that a build makes. They lead to files of the student's machine.
CATKINS = b'generated from catkin/cmake/template'
#: A larger file is not a program [bytes].
LARGEST_PROGRAM = 1000000


class Choice(NamedTuple):
    """The file that is chosen as the node."""

    path: str
    remarks: List[str]      # why, for the student
    look_at: List[str]      # for the instructor: the choice was by chance


class _Candidate(NamedTuple):
    """A file and its ranks, compared in this order: the file with the smallest is chosen."""

    aside: bool             # is it in a folder of what was put aside?
    package: int            # 0: a usual package; 1: one that begins like it; 2: another one
    name: int               # place among the usual names; len(names) if it has none
    signs: int              # how many signs of the node are missing
    folder: int             # place among the usual folders
    depth: int
    path: str
    sign_texts: Tuple[str, ...]   # the signs that were found
    text: str


def find_node(folder: Path, lab: NodeNames, package: str = '', name: str = '') -> Choice:
    """The file below `folder` that is the node of a lab.

    A file can be the node if it has a usual name, or listens to the lab's topic and has not the
    usual name of another lab's node, or has the names of class and node. If `package` or `name` is
    given, only such files are taken; `name` may be a path, in the printed form. ``NotJudged`` if no
    file is left.
    """
    packages = (package,) if package else lab.packages
    names = (os.path.basename(name),) if name else lab.files
    handed_in = files_in(folder)
    # a manifest is read once
    name_of = lru_cache(maxsize=None)(lambda found: name_in(found / MANIFEST)[0] if found else '')
    programs = sorted(
        _candidate(lab, str(path.relative_to(folder)), name_of(package_folder(path, folder)),
                   path.read_bytes().decode(errors='replace'), packages, names)
        for path in handed_in if _is_program(path))
    found = [each for each in programs
             if (not package or each.package == 0) and _can_be_the_node(each, names, name)
             and ('/' not in name or each.path == os.path.normpath(name))]
    if not found:
        raise NotJudged('There is no {}{}, and no other file does what it should. {}'.format(
            name or ' or '.join(names), ' in a package {}'.format(package) if package else '',
            _what_was_found(sorted(each.path for each in programs),
                            [str(path.relative_to(folder)) for path in handed_in])))
    alike = [each for each in found if each[:ALIKE] == found[0][:ALIKE]]
    look_at = []
    if len({each.text for each in alike}) > 1:
        other = alike[-1].path if '/' in alike[-1].path else './' + alike[-1].path
        look_at = ['Judged was {}. It is as likely the node as {}, and they differ: --type {} '
                   "chooses another one, with --only and the student's name.".format(
                       found[0].path, shortened([each.path for each in alike[1:]]),
                       shlex.quote(other))]
    return Choice(found[0].path, _remarks(found, packages, names), look_at)


def _is_program(path):
    if path.stat().st_size > LARGEST_PROGRAM:
        return False
    begin = path.read_bytes()[:300]
    return CATKINS not in begin and (
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


def _package_rank(usual, called):
    if usual in called:
        return 0
    # lab2_final and Lab2-main, but not lab20
    return 1 if any(re.match(re.escape(usual) + r'(?![a-z0-9])', name) for name in called) else 2


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
    why = next((why for rank, why in enumerate((
        'the others were put aside', 'it is in the package ' + ' or '.join(packages),
        'it has the usual name', 'it ' + signs)) if best[rank] != others[0][rank]),
        'it comes first')
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
