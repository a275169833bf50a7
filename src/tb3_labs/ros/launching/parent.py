"""The roslaunch that started this process, if one did, and its end."""
import os
import signal
from typing import List, Optional


class Roslaunch:
    """The roslaunch that started this process."""

    def __init__(self, pid: int, words: List[str]) -> None:
        self._pid = pid
        #: The words after `roslaunch`.
        self.words = words

    def end(self) -> None:
        """End it by SIGTERM, unless it has ended already.

        While it reads its files it has started nothing yet, and has no handler of signals: it ends
        without a word. Later it ends all that it has started, as by Ctrl+C.
        """
        if os.getppid() == self._pid:
            os.kill(self._pid, signal.SIGTERM)


def parent() -> Optional[Roslaunch]:
    """The roslaunch that started this process, if one did."""
    pid = os.getppid()
    with open('/proc/{}/cmdline'.format(pid)) as file:
        words = file.read().split('\0')[:-1]
    for place, word in enumerate(words[:2]):    # as a script it comes after its Python
        if os.path.basename(word) == 'roslaunch':
            return Roslaunch(pid, words[place + 1:])
    return None


def end_parent() -> None:
    """End the roslaunch that started this process, if one did; for a node that is about to end.

    If a required node ends by itself, roslaunch prints red lines, as after a failure.
    """
    roslaunch = parent()
    if roslaunch:
        roslaunch.end()
