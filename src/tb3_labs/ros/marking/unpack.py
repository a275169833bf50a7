"""Unpacks the zip file of a submission, whatever is in it."""
import os
import stat
import zipfile
from datetime import datetime
from pathlib import Path

from tb3_labs.marking.archives import Entry, Refused, check, path_in

#: This much is read at a time [bytes].
PIECE = 1 << 20


def unpack(path, folder, budget):
    """Unpack the zip file `path` into `folder`, which is made if need be, within a Budget.

    ``Refused`` if it is no zip file, or one that is not unpacked; then nothing of it counts. What
    it says of its sizes may be wrong: what really comes out is counted as well.
    """
    folder = Path(folder)
    try:
        with zipfile.ZipFile(str(path)) as archive:
            infos = [info for info in archive.infolist() if not info.filename.endswith('/')]
            check((_entry(info) for info in infos), budget)
            for info in infos:
                name = path_in(_entry(info))
                if name:
                    _unpack_file(archive, info, folder / name, budget)
    except (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError, ValueError,
            OSError) as problem:
        raise Refused('The zip file cannot be unpacked: {}.'.format(
            str(problem).rstrip('.') or type(problem).__name__)) from None


def newest_in(path):
    """When the newest file in a zip file was changed, a datetime; None if that is not known."""
    try:
        with zipfile.ZipFile(str(path)) as archive:
            times = [info.date_time for info in archive.infolist() if not info.is_dir()
                     and path_in(_entry(info))]
        return datetime(*max(times)) if times else None
    except (zipfile.BadZipFile, OSError, ValueError, Refused):
        return None


def _entry(info):
    mode = info.external_attr >> 16
    return Entry(info.filename, info.file_size, stat.S_ISLNK(mode), bool(info.flag_bits & 1))


def _unpack_file(archive, info, target, budget):
    budget.take(1, 0)
    target.parent.mkdir(parents=True, exist_ok=True)
    with archive.open(info) as source, open(str(target), 'wb') as file:
        for piece in iter(lambda: source.read(PIECE), b''):
            budget.take(0, len(piece))
            file.write(piece)
    if (info.external_attr >> 16) & 0o100:
        os.chmod(str(target), 0o755)
