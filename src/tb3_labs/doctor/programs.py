"""Which programs of this user are stopped by Ctrl+Z? The nodes of a stopped roslaunch run on."""
import os
from contextlib import suppress
from pathlib import Path
from typing import Iterator

from tb3_labs.doctor import Finding, warning


def judge_programs(master_uri: str) -> Iterator[Finding]:
    """Yields a finding on each stopped Python program of a terminal that uses the same master."""
    for folder in Path('/proc').glob('[0-9]*'):
        with suppress(OSError):    # the program has ended, or belongs to another user
            interpreter, *words = (folder / 'cmdline').read_text(errors='replace').split('\0')
            environment = (folder / 'environ').read_text(errors='replace').split('\0')
            status = (folder / 'stat').read_text(errors='replace')
            _, _, after_name = status.rpartition(') ')    # begins with the letter of the state
            is_stopped = after_name.startswith('T')
            is_of_this_user = folder.stat().st_uid == os.getuid()
            is_python_program = 'python' in interpreter and len(words) > 0
            has_same_master = f'ROS_MASTER_URI={master_uri}' in environment
            if is_stopped and is_of_this_user and is_python_program and has_same_master:
                command = ' '.join([os.path.basename(words[0]), *words[1:]]).strip()
                yield warning('Ctrl+Z', f'{command} (process {folder.name}) is stopped, not ended: '
                              'its master and nodes run on', 'in its terminal type fg, then Ctrl+C')
