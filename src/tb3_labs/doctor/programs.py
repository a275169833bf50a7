"""Which programs of this user are stopped? A stopped roslaunch keeps its master and nodes."""
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
            _, _, state = (folder / 'stat').read_text(errors='replace').rpartition(') ')
            if (state.startswith('T') and folder.stat().st_uid == os.getuid() and words
                    and 'python' in interpreter and f'ROS_MASTER_URI={master_uri}' in environment):
                command = ' '.join([os.path.basename(words[0]), *words[1:]]).strip()
                yield warning('Ctrl+Z', f'{command} (process {folder.name}) is stopped, not ended: '
                              'its master and nodes run on', 'in its terminal type fg, then Ctrl+C')
