"""The file of a submission that is the node of a lab.

A repository of a whole course has several files with the same name. A file is chosen by its
package, then by its name, then by what it does. Real submissions: see doc/instructor/marking.md.

Here all files of a submission are only read, as texts.
"""
import re
from pathlib import Path
from typing import List, NamedTuple, Sequence, Tuple

from tb3_labs.marking.marks import Lab
from tb3_labs.marking.packages import MANIFEST, files_in, name_in, package_folder

#: The folders of a package where nodes usually are, likeliest first.
FOLDERS = ('scripts', 'nodes', 'src')
LISTENS_TO = 'listens to '
#: A remark names at most this many files.
NAMED = 6
#: A larger file is not a program [bytes].
LARGEST_PROGRAM = 1000000


class NoNode(Exception):
    """A submission has no node that could be run; the text is the reason, a sentence."""


class SourceFile(NamedTuple):
    """A file of a submission that may be a node."""

    path: str       # within the submission, with '/'
    package: str    # the name in the nearest package.xml above it; '' if there is none
    text: str


class _Candidate(NamedTuple):
    """A file and its ranks, compared in this order: the file with the smallest is chosen."""

    package: int            # 0: a usual package; 1: one that begins like it; 2: another one
    name: int               # place among the usual names; len(names) if it has none
    signs: int              # how many signs of the node are missing
    folder: int             # place among the usual folders
    depth: int
    path: str
    said: Tuple[str, ...]   # the signs that were found


def find_node(folder: Path, lab: Lab, package: str = '', name: str = '') -> Tuple[Path, List[str]]:
    """The path of a Lab's node below `folder`, and remarks on the choice; see choose()."""
    files = []
    for path in filter(_is_program, files_in(folder)):
        found = package_folder(path, folder)
        files.append(SourceFile(str(path.relative_to(folder)),
                                name_in(found / MANIFEST)[0] if found else '',
                                path.read_bytes().decode(errors='replace')))
    if not files:
        others = [str(path.relative_to(folder)) for path in files_in(folder)]
        raise NoNode('{} {}'.format(_nothing_found([], package, (name,) if name else lab.files), (
            'Handed in: {}.'.format(_shortened(others)) if others else 'Nothing was handed in.')))
    chosen, remarks = choose(lab, files, package, name)
    return folder / chosen, remarks


def source_of(node: Path, folder: Path) -> Path:
    """Returns the folder to copy for a node: its package's; a guess if there is no package.xml."""
    found = package_folder(node, folder)
    if found is not None:
        return found
    in_usual = node.parent.name in FOLDERS and node.parent != folder
    return node.parent.parent if in_usual else node.parent


def _is_program(path):
    if path.stat().st_size > LARGEST_PROGRAM:
        return False
    return path.suffix == '.py' or not path.suffix and b'python' in path.read_bytes()[:80]


def choose(lab: Lab, files: Sequence[SourceFile], package: str = '',
           name: str = '') -> Tuple[str, List[str]]:
    """The path of the file that is chosen as the node of a lab, and sentences about why.

    A file can be the node if it has a usual name, or listens to the lab's topic, or has the names
    of class and node. Only files of `package` and called `name` count, if these are given.
    ``NoNode`` if no file is left.
    """
    packages, names = (package,) if package else lab.packages, (name,) if name else lab.files
    found = sorted(candidate for candidate in (
        _candidate(lab, file, packages, names) for file in files)
        if (not package or candidate.package == 0) and _can_be_the_node(candidate, names, name))
    if not found:
        raise NoNode(_nothing_found(files, package, names))
    return found[0].path, _remarks(found, packages, names)


def _candidate(lab, file, packages, names):
    *folders, name = file.path.lower().split('/')
    said = _signs(lab, file.text)
    lower = [usual.lower() for usual in names]
    return _Candidate(
        min(_package_rank(usual, [file.package] + folders) for usual in packages),
        lower.index(name) if name in lower else len(names), 3 - len(said),
        FOLDERS.index(folders[-1]) if folders and folders[-1] in FOLDERS else len(FOLDERS),
        len(folders), file.path, said)


def _package_rank(usual, called):
    """Returns 0 if one of these names is the `usual` one, 1 if one begins like it, else 2."""
    usual, called = usual.lower(), [name.lower() for name in called]
    if usual in called:
        return 0
    # lab2_final and Lab2-main, but not lab20
    return 1 if any(re.match(re.escape(usual) + r'(?![a-z0-9])', name) for name in called) else 2


def _signs(lab, text):
    """Returns the signs of the lab's node in a program, as clauses such as 'listens to imu'."""
    code = '\n'.join(line for line in text.splitlines() if not line.lstrip().startswith('#'))
    return tuple(said for pattern, said in (
        (r'Subscriber\(\s*(name\s*=\s*)?[\'"]/?(\w+/)*{}[\'"]'.format(lab.sensors[0]),
         LISTENS_TO + lab.sensors[0]),
        (r'^[ \t]*class\s+{}\b'.format(lab.class_name), 'has the class ' + lab.class_name),
        (r'init_node\(\s*(name\s*=\s*)?[\'"]{}[\'"]'.format(lab.node_name),
         'is the node ' + lab.node_name),
    ) if re.search(pattern, code, re.MULTILINE))


def _can_be_the_node(candidate, names, name):
    if candidate.name < len(names):
        return True
    said = candidate.said
    return not name and (len(said) >= 2 or any(clause.startswith(LISTENS_TO) for clause in said))


def _remarks(found, packages, names):
    best, others = found[0], found[1:]
    if not others:
        if best.name < len(names):
            return []
        return ['There is no {}; judged was {}, which {}.'.format(
            ' or '.join(names), best.path, _listed(best.said))]
    second = others[0]
    if best.package != second.package:
        why = 'it is in the package {}'.format(' or '.join(packages))
    elif best.name != second.name:
        why = 'it has the usual name'
    elif best.signs != second.signs:
        why = 'it {}'.format(_listed(best.said))
    else:
        why = 'it comes first'
    if best.package == 2 and any(packages):
        why += ' (there is no package {})'.format(' or '.join(packages))
    named = _shortened([other.path for other in others])
    return ['{} files can be the node; judged was {}, because {}. The others: {}.'.format(
        len(found), best.path, why, named)]


def _shortened(paths):
    more = len(paths) - NAMED
    return ', '.join(paths[:NAMED]) + ' and {} more'.format(more) * (more > 0)


def _listed(clauses):
    """`a`, `a and b`, `a, b and c`."""
    return ' and '.join(filter(None, [', '.join(clauses[:-1]), clauses[-1]]))


def _nothing_found(files, package, names):
    there = sorted(file.path for file in files)
    said = 'There is no {}{}, and no other file does what it should. '.format(
        ' or '.join(names), ' in a package {}'.format(package) if package else '')
    return said + ('Python files that were found (--package and --type choose another one): {}.'
                   .format(_shortened(there)) if there else 'No Python file was found at all.')
