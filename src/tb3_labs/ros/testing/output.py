"""The output of a program, read while it runs."""
import os
import threading
import time

from tb3_labs.ros.testing.bounded_text import BoundedText

#: Output is read no faster than this, so that much of it does not load the machine [characters/s].
FASTEST_READING = 1e6


class Output:
    """The text that comes from the file descriptor `source`, of which head and tail are kept."""

    def __init__(self, source):
        self._source = source
        self._changed = threading.Condition()
        self._text = BoundedText()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        while True:
            try:
                chunk = os.read(self._source, 65536)
            except OSError:    # the other side of a pseudo-terminal is closed
                chunk = b''
            with self._changed:
                self._text.append(chunk.decode(errors='replace').replace('\r\n', '\n'))
                self._changed.notify_all()
            if not chunk:
                return
            time.sleep(len(chunk) / FASTEST_READING)

    def __str__(self):
        with self._changed:
            return str(self._text)

    @property
    def size(self):
        """The amount so far: (characters, lines)."""
        with self._changed:
            return self._text.length, self._text.lines

    def since(self, characters):
        """The text after the first `characters`, as far as it is kept."""
        with self._changed:
            return self._text.since(characters)

    def wait_for(self, words, seconds, times):
        """Wait until `words` came `times` times; RuntimeError with the output if not."""
        self._wait(lambda text: text.count(words) >= times, seconds, repr(words))

    def wait_for_match(self, pattern, seconds):
        """Wait until the regular expression `pattern` is found in all that came; RuntimeError with
        the output if not."""
        self._wait(pattern.search, seconds, pattern.pattern)

    def _wait(self, holds, seconds, wanted):
        with self._changed:
            if not self._changed.wait_for(lambda: holds(str(self._text)), seconds):
                raise RuntimeError('waited {:.0f} s in vain for {}; printed: {}'.format(
                    seconds, wanted, self._text))

    def wait_for_the_end(self, seconds):
        """Wait until the other side is closed, at most `seconds`."""
        self._reader.join(seconds)
