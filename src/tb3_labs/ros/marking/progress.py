"""What is tried now: on a terminal one line that is renewed, else a line whenever it changes."""
import shutil
import threading

#: How a line of progress begins that another program reads, as mark.py reads those of the check.
TRYING = 'trying '
#: Back to the begin of a terminal's line, and clear it.
RENEW = '\r\x1b[K'


def tried_last(log):
    """The latest of such lines in the text of a log, without its beginning; '' if there is none."""
    lines = [line for line in log.splitlines() if line.startswith(TRYING)]
    return lines[-1][len(TRYING):] if lines else ''


class Progress:
    """Writes lines to a stream, and below them what several tasks are doing now. For any thread."""

    def __init__(self, stream):
        self._stream, self._terminal = stream, stream.isatty()
        self._now, self._shown = {}, {}
        self._lock = threading.Lock()

    def line(self, words):
        """Write a line that stays."""
        with self._lock:
            self._stream.write(RENEW * self._terminal + words + '\n')
            self._draw()

    def done(self, task):
        """A task has ended, whatever became of it."""
        with self._lock:
            self._now.pop(task, None)
            self._draw()

    def now(self, task, words, detail=''):
        """What a task does now. Without a terminal `detail` is left out, and only a change is
        written."""
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
