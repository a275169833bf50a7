"""The lines that a node prints: log lines by rospy's own functions, news of a core, and plain text
that is not a log line, such as a table.

A terminal may block at any time (Ctrl+S, a window that hangs, a pipe that nobody reads). /rosout
may block as well: for each line rospy asks the master for a parameter, and a master that cannot be
reached does not answer for minutes. Then the thread that logs would wait, and every thread that
needs its lock: a robot would drive on, or never move again. So there is a queue for the terminal
and one for /rosout, and only the threads that empty them may wait. A full queue drops new lines;
the terminal later shows their number.
"""
import queue
import sys
import threading
from functools import partial

import rospy

from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.rospy_internals import after_hooks, print_by, publish_log_by

#: Largest number of lines that wait in a queue.
CAPACITY = 1000
#: When a node ends: longest wait for room in the queue, and then for the last lines [s].
LAST_WAIT = 1.0
#: When a node ends: longest wait until the last lines are published on /rosout [s].
LAST_WAIT_FOR_ROSOUT = 0.2

_console = None


def start():
    """Let all lines of this process go through the queues. Call it after rospy.init_node()."""
    global _console
    _console = _Queue('console', _print_note)
    print_by(_console.put)
    rosout = _Queue('rosout')
    publish_log_by(rosout.put)
    after_hooks(lambda: rosout.flush(LAST_WAIT_FOR_ROSOUT))    # before /rosout is closed


def say(text):
    """Print a text that is not a log line, in order with the log lines."""
    if _console is None:
        print(text, flush=True)
    else:
        _console.put(lambda: print(text))


def log_news(news):
    """Log each line of `news`, a core's news.News: as a warning if it is one, else as info."""
    for line in news:
        (rospy.logwarn if line.warning else rospy.loginfo)('%s', line.text)


def flush():
    """Wait until everything is printed. Returns False if the terminal blocks or is closed. Then
    Python's own end would wait for the terminal, or (since 3.13) make the exit status 120."""
    if _console is not None and not _console.flush(LAST_WAIT):
        return False
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except (AttributeError, OSError, ValueError):    # an output that was never open is None
        return False
    return True


class _Queue:
    """A queue of jobs, and the thread that carries them out in order."""

    def __init__(self, name, note=lambda dropped: None):
        """`note(dropped)` reports a number of dropped jobs."""
        self._waiting = queue.Queue(CAPACITY)
        self._note = note
        self._lock = threading.Lock()    # guards `_dropped`; its holder does not wait
        self._dropped = 0
        threading.Thread(target=self._run, name=name, daemon=True).start()

    def put(self, job):
        """Call `job()` in its turn."""
        with self._lock:
            if not self._offer(job):
                self._dropped += 1

    def flush(self, seconds):
        """Wait until all jobs are done. Returns False if that takes too long."""
        done = threading.Event()

        def ask():
            with self._lock:
                return self._offer(done.set)
        return wait_until(ask, seconds) and done.wait(seconds)

    def _offer(self, job):
        """Put a note of dropped jobs and `job` into the queue. Returns False if it is full."""
        try:
            if self._dropped:
                self._waiting.put_nowait(partial(self._note, self._dropped))
            self._dropped = 0
            self._waiting.put_nowait(job)
        except queue.Full:
            return False
        return True

    def _run(self):
        while True:
            job = self._waiting.get()
            try:
                job()
                sys.stdout.flush()
                sys.stderr.flush()
            except (OSError, ValueError):
                pass    # the terminal is closed; the log file and /rosout still get the log lines


def _print_note(dropped):
    print('... {} lines were dropped here: the terminal did not take them'.format(dropped))
