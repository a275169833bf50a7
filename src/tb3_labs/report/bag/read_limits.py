"""The budget of reading a bag: a stranger's file may have too much of anything.

Each read, each unpacked piece, each record and each sample takes from one ReadLimits; nothing is
read in a larger piece than the limits below. So memory and time are bounded, whatever the file
claims.
"""
import time
from typing import Dict

#: The most of each in one reading, and its longest processor time [s]. An hour of
#: record.launch has 1.4 million records, and takes 20 s. MiB are read or unpacked.
MOST_READ = {'records': 2000000, 'connections': 20000, 'samples': 1500000, 'MiB': 1024}
MOST_TIME = 30.0
MIB = 2.0 ** 20
#: The processor time is read at each of so many spendings: to read it takes longer than to spend.
CLOCK_EVERY = 64
#: The largest header, connection and message, and the longest name [bytes].
MOST_HEADER, MOST_CONNECTION, MOST_MESSAGE, MOST_NAME = 10000, 2 ** 20, 2 ** 18, 200
#: The most that a packed chunk holds; it is read in parts, and unpacked in pieces [bytes].
MOST_CHUNK, PART, PIECE = 2 ** 26, 2 ** 12, 2 ** 20
#: The most lines of a topic, characters of a line, and characters of all lines of a topic.
MOST_LINES, LONGEST_LINE, MOST_LETTERS = 20000, 4000, 2 ** 23
#: The most values of nodes' variables: 15 minutes of a node with fifteen.
MOST_VARIABLES = 300000
#: A line about a trial, by the marker, has at most this many characters.
LONGEST_EVENT = 200000


class TooLarge(Exception):
    """The budget is used up; the message names what is too much, and the limit."""


class ReadLimits:
    """The rest of the limits for one reading of a bag."""

    def __init__(self) -> None:
        self._left: Dict[str, float] = dict(MOST_READ)
        self._end, self._spent = time.thread_time() + MOST_TIME, 0

    def spend(self, what: str, amount: float = 1) -> None:
        """Take `amount` of `what`, a key of MOST_READ. Raises TooLarge."""
        left = self._left[what] = self._left[what] - amount
        if left < 0:
            raise TooLarge(f'it has more than {MOST_READ[what]:,} {what}')
        self._spent += 1
        if not self._spent % CLOCK_EVERY and time.thread_time() > self._end:
            raise TooLarge(f'to read it takes longer than {MOST_TIME:g} s')
