"""What a node prints, printed by a thread of its own.

A terminal may stop taking text for as long as somebody likes (Ctrl+S, a window that hangs, a pipe
that nobody reads). Whoever prints then waits, and with it every thread that wants the same lock:
a robot would drive on, or never move again. So log lines go into a queue, and only the thread that
empties it may wait. A queue that is full drops new lines, and says how many later.
"""
import queue
import sys
import threading

from tb3_labs.ros.rospy_internals import print_by

#: So many lines wait at most.
MOST_LINES = 1000
#: Longest wait for the last lines to be printed, when a node ends [s].
LAST_WAIT = 1.0


class Console:
    """Takes over what rospy prints, once rospy.init_node() has set that up."""

    def __init__(self):
        self._waiting = queue.Queue(MOST_LINES)
        self._dropped = 0
        print_by(self._put)
        threading.Thread(target=self._run, name='console', daemon=True).start()

    def say(self, text):
        """Print a text as it is, after the log lines so far."""
        self._put(lambda: print(text))

    def flush(self):
        """Wait until all is printed. False where the terminal does not take it."""
        printed = threading.Event()
        self._put(printed.set)
        return printed.wait(LAST_WAIT)

    def _put(self, job):
        try:
            if self._dropped:
                dropped = self._dropped
                self._waiting.put_nowait(lambda: print('... {} lines were dropped here: the '
                                                       'terminal did not take them'.format(dropped)))
                self._dropped = 0
            self._waiting.put_nowait(job)
        except queue.Full:
            self._dropped += 1

    def _run(self):
        while True:
            job = self._waiting.get()
            try:
                job()
                sys.stdout.flush()
                sys.stderr.flush()
            except (OSError, ValueError):
                pass    # the terminal has gone; the log file and /rosout have it all
