"""The students' edition: this package without its solutions, and with a README for students.

The list of what is left out is a plain file. Each line is a path from the package's folder; the
path of a folder ends in a slash. If a line begins with !, its path stays, even if a line
above leaves its folder out, as in .gitignore.
"""
import os
import shutil
import subprocess
from pathlib import Path
from typing import Iterable, List, Set

LIST = 'doc/instructor/edition.txt'
#: This file replaces the package's own README in the edition.
README = 'doc/instructor/README.students.md'
#: If git does not list the sources: these names are not sources, and these hidden names are.
NO_SOURCES = {'build', '__pycache__'}
HIDDEN_SOURCES = {'.ci', '.devcontainer', '.dockerignore', '.gitattributes', '.gitignore',
                  '.run_test.py'}


def kept(paths: Iterable[str], rules: str) -> List[str]:
    """Returns the paths that stay in the edition. `rules`: the text of the list.

    ``ValueError`` if a line matches no path.
    """
    left: Set[str] = set()
    paths = list(paths)
    for line in rules.splitlines():
        rule = line.partition('#')[0].strip()
        if not rule:
            continue
        name = rule.lstrip('!')
        matched = {path for path in paths
                   if path == name or name.endswith('/') and path.startswith(name)}
        if not matched:
            raise ValueError('{} has a line without a file: {}'.format(LIST, rule))
        left = left - matched if rule.startswith('!') else left | matched
    return [path for path in paths if path not in left]


def checked_place(folder: Path, root: Path) -> Path:
    """Returns the folder for the edition; ``ValueError`` if the edition cannot be written there."""
    place = folder.expanduser().resolve()
    if place == root or root in place.parents:
        raise ValueError('{} is inside of {}: give a folder outside of it'.format(place, root))
    if place.exists() and (not place.is_dir() or any(place.iterdir())):
        raise ValueError('{} exists and is not an empty folder: give a new one'.format(place))
    return place


def paths_of(root: Path) -> List[str]:
    """Returns the package's files, relative to `root`: the files in git, or else all sources."""
    if (root / '.git').exists():
        listed = subprocess.run(['git', 'ls-files', '-z'], cwd=str(root), stdout=subprocess.PIPE,
                                stderr=subprocess.DEVNULL, check=False)
        paths = [path for path in listed.stdout.decode().split('\0') if path]
        if listed.returncode == 0 and paths:
            return [path for path in paths if (root / path).is_file()]
    paths = []
    for folder, folders, names in os.walk(str(root)):
        folders[:] = [name for name in folders if _is_source(name)]
        paths += [(Path(folder) / name).relative_to(root).as_posix()
                  for name in names if _is_source(name) and not name.endswith('.pyc')]
    return sorted(paths)


def _is_source(name: str) -> bool:
    """May a file or folder of this name be a source?"""
    return (name in HIDDEN_SOURCES or not name.startswith('.')) and (
        name not in NO_SOURCES and not name.endswith('.egg-info'))


def write(root: Path, place: Path) -> int:
    """Write the edition of the package in `root` into `place`. Returns the number of files."""
    paths = kept(paths_of(root), (root / LIST).read_text(encoding='utf-8'))
    for path in paths:
        target = place / path
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(str(root / (README if path == 'README.md' else path)), str(target))
    return len(paths)
