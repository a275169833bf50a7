"""The progress of a trial: on a terminal one line that is renewed, else a line at each change."""
import shutil
import threading
from typing import Dict, TextIO

#: A line of progress for another program begins so: mark.py reads these lines of the check.
TRYING = 'trying '
#: Go to the begin of the terminal's line, and clear the line.
RENEW = '\r\x1b[K'


def tried_last(log: str) -> str:
    """Returns the latest line of a log that begins with TRYING, without TRYING; '' if there is
    none."""
    lines = [line for line in log.splitlines() if line.startswith(TRYING)]
    return lines[-1][len(TRYING):] if lines else ''


class Progress:
    """Writes lines to a stream, and below them the step of each task. Any thread may call it."""

    def __init__(self, stream: TextIO) -> None:
        self._stream, self._terminal = stream, stream.isatty()
        self._now: Dict[str, str] = {}
        self._shown: Dict[str, str] = {}
        self._lock = threading.Lock()

    def line(self, words: str) -> None:
        """Write a line that stays."""
        with self._lock:
            self._stream.write(RENEW * self._terminal + words + '\n')
            self._draw()

    def done(self, task: str) -> None:
        """A task has ended."""
        with self._lock:
            self._now.pop(task, None)
            self._draw()

    def now(self, task: str, words: str, detail: str = '') -> None:
        """Show the step of a task.

        If the stream is not a terminal, only a change of `words` is written, without `detail`.
        """
        with self._lock:
            if self._terminal:
                self._now[task] = words + detail
                self._draw()
            elif self._shown.get(task) != words:
                self._shown[task] = words
                self._stream.write(words + '\n')
                self._stream.flush()

    def _draw(self):
        if self._terminal:
            width = shutil.get_terminal_size().columns - 1
            self._stream.write(RENEW + ' | '.join(self._now.values())[:width])
        self._stream.flush()
