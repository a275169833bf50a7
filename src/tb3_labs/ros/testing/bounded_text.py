"""Text of any length in bounded memory: its head and its tail are kept."""

#: Number of characters kept at either end.
KEPT_CHARACTERS = 100000


class BoundedText:
    """The output of a program that may print for ever."""

    def __init__(self, kept=KEPT_CHARACTERS):
        self._kept = kept
        self._head = ''
        self._tail = ''
        #: Characters and line ends so far, also those that were dropped.
        self.length = 0
        self.lines = 0

    def append(self, text):
        """Add `text` at the end."""
        self.length += len(text)
        self.lines += text.count('\n')
        room = self._kept - len(self._head)
        self._head += text[:room]
        self._tail += text[room:]
        if len(self._tail) > 2 * self._kept:    # not at each call, since it copies
            self._tail = self._tail[-self._kept:]

    def __str__(self):
        dropped = self.length - len(self._head) - len(self._tail)
        if not dropped:
            return self._head + self._tail
        return '{}\n... {} characters are left out here ...\n{}'.format(
            self._head, dropped, self._tail)

    def since(self, length):
        """The text after the first `length` characters, as far as it is kept."""
        tail_begins = self.length - len(self._tail)
        return self._head[length:] + self._tail[max(0, length - tail_begins):]
