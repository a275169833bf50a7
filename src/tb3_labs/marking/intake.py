"""The submissions as they come: folders, zip files of a learning platform, a list of repositories.

Nothing that was handed in is changed or run: it is copied into a folder of its own, which has no
links, no devices, and no more than a budget. All later steps look at this copy.
"""
import hashlib
import os
import re
import shutil
import stat
import subprocess
from collections import Counter
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Callable, List, NamedTuple, Optional, Tuple

from tb3_labs.marking.archives import DEEPEST, LEFT_OUT, Budget, Refused, newest_in, unpack
from tb3_labs.marking.names import by_student, is_zip, printable, repositories
from tb3_labs.marking.packages import files_in

#: A zip file may hold another one, up to this depth.
DEPTH = 3
#: Archives that are not unpacked.
OTHER_ARCHIVES = ('.rar', '.7z', '.tar', '.gz', '.tgz', '.xz', '.bz2')
#: A larger file is not copied, unless it is an archive [bytes].
LARGEST = 20000000
#: This number of files that were left out is named in a remark.
NAMED = 3
COMMITTER = re.compile(r'^committer .* (\d+) [+-]\d{4}$', re.MULTILINE)
#: git for a repository that nobody has checked: it runs no program and asks no other machine.
GIT = 'git --no-replace-objects -c core.fsmonitor=false -c safe.directory=*'.split()


class Copy(NamedTuple):
    """A copy of a submission, unpacked."""

    folder: Path            # called as the student
    remarks: List[str]      # on files that were left out
    unread: List[str]       # on archives that could not be unpacked


@dataclass
class Submission:
    """The files and folders that one student handed in."""

    student: str
    paths: List[Path]                       # folders and files
    names: List[str] = field(default_factory=list)     # the student's own names of the files
    late: bool = False                      # as the platform says

    def lay_out(self, work: Path) -> Copy:
        """Copy it into a folder below `work`, an existing folder."""
        copy, budget = Copy(Path(work) / self.student, [], []), Budget()
        copy.folder.mkdir()
        try:
            for path, name in zip(self.paths, self.names or [path.name for path in self.paths]):
                if path.is_dir():
                    _copy_folder(path, copy, budget)
                else:
                    _copy_file(path, copy.folder / name, budget)
        except Refused as reason:
            copy.unread.append(str(reason))
        _unpack_all(copy, budget)
        return copy

    def handed_in_at(self) -> Tuple[Optional[datetime], str]:
        """(the time, the thing that has this time); None for the time if it is not known.

        That of the last commit if it is a repository, else of the newest file: of a zip file as it
        says itself, of other files as this computer says.
        """
        if len(self.paths) == 1 and (self.paths[0] / '.git').exists():
            committed = _committed_at(self.paths[0])
            if committed is not None:
                return committed, 'the last commit'
        times = []
        for path in self.paths:
            for file in [path] if path.is_file() else sort_out(path)[0]:
                inside = newest_in(file) if is_zip(file.name) else None
                times.append(inside or datetime.fromtimestamp(file.stat().st_mtime))
        return max(times, default=None), 'the newest file'


def submissions_from(path: Path, work: Path, tell: Callable[[str], None]) -> List[Submission]:
    """The Submissions in a folder, a zip file, or a list of repositories, in order of their names.

    `work`: an existing folder for unpacked files; ``tell(line)`` hears which files are left out.
    ``ValueError``, ``OSError`` or ``Refused`` if there is nothing to mark.
    """
    path = Path(path)
    if path.is_dir():
        return _in_folder(path, tell)
    if is_zip(path.name):
        unpack(path, Path(work) / 'all', Budget())
        return _in_folder(_without_wrapping(Path(work) / 'all'), tell)
    try:
        listed = repositories(path.read_text(encoding='utf-8-sig'))
    except ValueError as problem:
        raise ValueError('{}, read as a list of repositories: {}'.format(path, problem)) from None
    found = []
    for name, place in sorted(listed.items()):
        folder = path.parent / Path(place).expanduser()
        if not folder.is_dir():
            raise ValueError('{}: there is no folder {}'.format(path, folder))
        found.append(Submission(name, [folder]))
    if not found:
        raise ValueError('there is no repository in the list {}'.format(path))
    return found


def digest(folder: Path) -> str:
    """A text that differs if anything in the copy of a submission does."""
    whole = hashlib.sha256()
    for path in files_in(folder):
        whole.update('{} {}\n'.format(path.relative_to(folder), path.stat().st_size).encode(
            errors='surrogateescape'))
        whole.update(path.read_bytes())
    return whole.hexdigest()


def sort_out(folder: Path) -> Tuple[List[Path], List[Path]]:
    """(files, others) below a folder, zip files too, but not those that are nobody's work.

    The others are links, devices, and folders that are too deep. A file that has another name
    outside of the folder is a link as well: it may be anybody's.
    """
    files, others, top = {}, [], len(folder.parts)
    for root, folders, names in os.walk(str(folder)):
        folders[:] = sorted(name for name in folders if not LEFT_OUT.search(name))
        others += [path for path in map(Path(root).joinpath, folders) if path.is_symlink()]
        if len(Path(root).parts) - top >= DEEPEST:
            others += [Path(root) / name for name in folders]
            folders.clear()
        for path in (Path(root) / name for name in sorted(names) if not LEFT_OUT.search(name)):
            about = path.lstat()
            if stat.S_ISREG(about.st_mode):
                files[path] = about
            else:
                others.append(path)
    names_of = Counter((about.st_dev, about.st_ino) for about in files.values())
    inside = {path: about.st_nlink <= names_of[about.st_dev, about.st_ino]
              for path, about in files.items()}
    return ([path for path in files if inside[path]],
            others + [path for path in files if not inside[path]])


def _in_folder(folder, tell):
    paths = {path.name: path for path in sorted(folder.iterdir())
             if not path.name.startswith('.') and not LEFT_OUT.search(path.name)}
    found = []
    for student, parts in by_student((name, path.is_dir()) for name, path in paths.items()).items():
        submission = Submission(student, [])
        for name, said in parts:
            if paths[name].is_dir() or said.number or is_zip(name):
                submission.paths.append(paths[name])
                submission.names.append(said.file)
                submission.late |= said.late
            else:
                tell('left out, because it is neither a folder nor a zip file: {}'.format(
                    paths[name]))
        if submission.paths:
            found.append(submission)
    if not found:
        raise ValueError('there is no folder and no zip file in {}'.format(folder))
    return sorted(found, key=lambda submission: submission.student)


def _without_wrapping(folder):
    """The only folder in a folder, if there are only folders and zip files in it: many programs put
    one round the whole."""
    inside = list(folder.iterdir())
    if len(inside) == 1 and inside[0].is_dir() and all(
            path.is_dir() or is_zip(path.name) for path in inside[0].iterdir()):
        return inside[0]
    return folder


def _copy_folder(source, copy, budget):
    files, others = sort_out(source)
    small = [path for path in files if is_zip(path.name) or path.stat().st_size <= LARGEST]
    for what, left in (('a link, a device, or too deep', others),
                       ('larger than {:g} MB'.format(LARGEST / 1e6), set(files) - set(small))):
        if left:
            named = [printable(str(path.relative_to(source))) for path in sorted(left)]
            copy.remarks.append('Left out, because each is {}: {}.'.format(what, ', '.join(
                named[:NAMED] + ['{} more'.format(len(named) - NAMED)] * (len(named) > NAMED))))
    for path in sorted(small, key=lambda path: path.stat().st_size):    # programs are small
        _copy_file(path, copy.folder / path.relative_to(source), budget)


def _copy_file(source, target, budget):
    budget.take(1, source.stat().st_size)
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(str(source), str(target))
    target.chmod(0o755 if os.access(str(source), os.X_OK) else 0o644)


def _unpack_all(copy, budget):
    """Unpack the zip files below a folder, and those in them, as long as there is no Python file
    yet: a zip file beside the code is none of it."""
    for _ in range(DEPTH):
        files = sort_out(copy.folder)[0]
        archives = [path for path in files if is_zip(path.name)]
        if any(path.suffix == '.py' for path in files):
            return
        if not archives:
            break
        for path in archives:
            try:
                unpack(path, path.parent / (path.stem + '.unpacked'), budget)
            except Refused as reason:
                copy.unread.append(str(reason))
            path.unlink()
    others = [path.name for path in sort_out(copy.folder)[0]
              if path.suffix.lower() in OTHER_ARCHIVES]
    if others:
        copy.unread.append('{} was not unpacked: only zip files are.'.format(others[0]))


def _committed_at(folder):
    try:
        done = subprocess.run(
            [*GIT, '-C', str(folder), 'cat-file', 'commit', 'HEAD'], stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, timeout=20.0, check=True,
            env={'PATH': os.environ.get('PATH', ''), 'GIT_ALLOW_PROTOCOL': 'nothing',
                 'GIT_CONFIG_NOSYSTEM': '1', 'GIT_TERMINAL_PROMPT': '0'})
    except (OSError, subprocess.SubprocessError):
        return None
    found = COMMITTER.search(done.stdout.decode(errors='replace'))
    return datetime.fromtimestamp(int(found.group(1))) if found else None
