"""The submissions as they come: folders, zip files of a learning platform, a list of repositories.

Nothing that was handed in is changed: what is unpacked goes into a folder of its own.
"""
import hashlib
import os
import re
import shutil
import subprocess
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import List

from tb3_labs.marking.archives import LEFT_OUT, Refused
from tb3_labs.marking.handed_in import by_student, is_zip, repositories
from tb3_labs.ros.marking.submission import files_in
from tb3_labs.ros.marking.unpack import newest_in, unpack

#: A zip file may hold another one, up to this depth.
DEPTH = 3
#: Archives that are not unpacked.
OTHER_ARCHIVES = ('.rar', '.7z', '.tar', '.gz', '.tgz', '.xz', '.bz2')
#: A file larger than this is not read for the digest, only its size counts [bytes].
LARGEST = 20000000
COMMITTER = re.compile(r'^committer .* (\d+) [+-]\d{4}$', re.MULTILINE)
#: git as a stranger's repository needs it: it runs no program and asks no other machine.
GIT = ('git', '--no-replace-objects', '-c', 'core.fsmonitor=false', '-c', 'safe.directory=*')


@dataclass
class Submission:
    """What one student handed in."""

    student: str
    paths: List[Path]                       # folders and files
    names: List[str] = field(default_factory=list)     # the student's own names of the files
    late: bool = False                      # as the platform says

    def lay_out(self, work):
        """The folder with all that was handed in, called as the student, and remarks.

        It is a link below `work`, an existing folder, or a copy that is unpacked.
        """
        folder, remarks = Path(work) / self.student, []
        if len(self.paths) == 1 and self.paths[0].is_dir() and not _is_packed(self.paths[0]):
            folder.symlink_to(self.paths[0].resolve(), target_is_directory=True)
            return folder, remarks
        for path, name in zip(self.paths, self.names or [path.name for path in self.paths]):
            for file in files_and_archives_in(path) if path.is_dir() else [path]:
                target = folder / (file.relative_to(path) if path.is_dir() else name)
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(str(file), str(target))
        _unpack_all(folder, remarks)
        return folder, remarks

    def handed_in_at(self):
        """(a datetime, what it is the time of); None for the first if it is not known.

        That of the last commit if it is a repository, else of the newest file: of a zip file as it
        says itself, of other files as this computer says.
        """
        if len(self.paths) == 1 and (self.paths[0] / '.git').exists():
            committed = _committed_at(self.paths[0])
            if committed is not None:
                return committed, 'the last commit'
        times = []
        for path in self.paths:
            for file in [path] if path.is_file() else files_and_archives_in(path):
                inside = newest_in(file) if is_zip(file.name) else None
                times.append(inside or datetime.fromtimestamp(file.stat().st_mtime))
        return max(times, default=None), 'the newest file'


def submissions_from(path, work, tell):
    """The Submissions in a folder, a zip file, or a list of repositories, in order of their names.

    `work`: an existing folder for what is unpacked; ``tell(line)`` hears what is left out.
    ``ValueError``, ``OSError`` or ``Refused`` if there is nothing to mark.
    """
    path = Path(path)
    if path.is_dir():
        return _in_folder(path, tell)
    if is_zip(path.name):
        unpack(path, Path(work) / 'all')
        return _in_folder(_without_wrapping(Path(work) / 'all'), tell)
    try:
        listed = repositories(path.read_text(encoding='utf-8-sig'))
    except ValueError as problem:
        raise ValueError('{}, read as a list of repositories: {}'.format(path, problem)) from None
    found = [Submission(name, [path.parent / Path(place).expanduser()])
             for name, place in listed.items()]
    for submission in found:
        if not submission.paths[0].is_dir():
            raise ValueError('{}: there is no folder {}'.format(path, submission.paths[0]))
    if not found:
        raise ValueError('there is no repository in the list {}'.format(path))
    return sorted(found, key=lambda submission: submission.student)


def digest(folder):
    """A text that is different as soon as anything in a submission is."""
    whole = hashlib.sha256()
    for path in files_in(Path(os.path.realpath(str(folder)))):
        size = path.stat().st_size
        whole.update('{} {}\n'.format(path.relative_to(os.path.realpath(str(folder))),
                                      size).encode(errors='replace'))
        if size <= LARGEST:
            whole.update(path.read_bytes())
    return whole.hexdigest()


def files_and_archives_in(folder):
    """The files below a folder, zip files too, but not what is nobody's work; no links."""
    for root, folders, files in os.walk(str(folder)):
        folders[:] = sorted(name for name in folders if not LEFT_OUT.search(name))
        for name in sorted(files):
            path = Path(root) / name
            if not LEFT_OUT.search(name) and path.is_file() and not path.is_symlink():
                yield path


def _in_folder(folder, tell):
    paths = {path.name: path for path in sorted(folder.iterdir())
             if not path.name.startswith('.') and not LEFT_OUT.search(path.name)}
    groups = by_student((name, path.is_dir()) for name, path in paths.items())
    found = []
    for student, parts in groups.items():
        kept = [(paths[name], said) for name, said in parts
                if paths[name].is_dir() or said.number or is_zip(name)]
        for name, _ in parts:
            if not any(path.name == name for path, _ in kept):
                tell('left out, because it is neither a folder nor a zip file: {}'.format(
                    paths[name]))
        if kept:
            found.append(Submission(
                student, [path for path, _ in kept], [said.file for _, said in kept],
                any(said.late for _, said in kept)))
    if not found:
        raise ValueError('there is no folder and no zip file in {}'.format(folder))
    return sorted(found, key=lambda submission: submission.student)


def _without_wrapping(folder):
    """The folder in a folder that holds nothing else, if there are only folders and zip files in
    it: many programs put one round the whole."""
    inside = list(folder.iterdir())
    if len(inside) == 1 and inside[0].is_dir() and all(
            path.is_dir() or is_zip(path.name) for path in inside[0].iterdir()):
        return inside[0]
    return folder


def _is_packed(folder):
    """Is all that is in a folder in zip files?"""
    files = list(files_and_archives_in(folder))
    return any(is_zip(path.name) for path in files) and not any(
        path.suffix == '.py' for path in files)


def _unpack_all(folder, remarks):
    """Unpack the zip files below a folder, and those in them, as long as there is no Python file
    yet: a zip file beside the code is none of it."""
    for _ in range(DEPTH):
        files = list(files_and_archives_in(folder))
        archives = [path for path in files if is_zip(path.name)]
        if not archives or any(path.suffix == '.py' for path in files):
            break
        for path in archives:
            try:
                unpack(path, path.parent / (path.stem + '.unpacked'))
            except Refused as reason:
                remarks.append(str(reason))
            path.unlink()
    others = [path.name for path in files_and_archives_in(folder)
              if path.suffix.lower() in OTHER_ARCHIVES]
    if others:
        remarks.append('{} was not unpacked: only zip files are.'.format(others[0]))


def _committed_at(folder):
    """When the last commit of a repository was made, a datetime; None if that is not known."""
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
