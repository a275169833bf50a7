"""The log of all nodes, as lines for pages."""
import threading
import time
from collections import deque

from rosgraph_msgs.msg import Log

from tb3_labs.ros.topics import subscribe

#: Number of lines kept for a page that comes later.
KEPT = 200
#: A line is cut after this number of characters.
LONGEST = 500
_LEVELS = ((Log.ERROR, 'error'), (Log.WARN, 'warn'), (Log.INFO, 'info'))


class LogLines:
    """Collects the lines of /rosout from the level INFO on."""

    def __init__(self):
        self._lock = threading.Lock()    # each node's lines come by a thread of their own
        self._kept = deque(maxlen=KEPT)
        #: Number of lines so far.
        self.count = 0
        subscribe('/rosout', Log, self._on_line, queue_size=None)

    def since(self, count):
        """The lines after the first `count`, as far as they are kept."""
        with self._lock:
            fresh = min(self.count - count, len(self._kept))
            return list(self._kept)[len(self._kept) - fresh:]

    def _on_line(self, message):
        level = next((name for least, name in _LEVELS if message.level >= least), None)
        if level is None:
            return
        with self._lock:
            self.count += 1
            self._kept.append({'time': time.strftime('%H:%M:%S'), 'level': level,
                               'node': message.name, 'text': message.msg[:LONGEST]})


def lines_of(lines, robots, robot):
    """Those of `lines` that belong to `robot`, one of the namespaces `robots`, or to none of
    them."""
    others = tuple('/{}/'.format(name) for name in robots if name and name != robot)
    return [line for line in lines if not (line['node'] + '/').startswith(others)]
