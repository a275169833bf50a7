"""The gate of a node: what is heard goes in to its core, what the core decides leaves in order."""
import queue
import threading

from tb3_labs.ros.cmd_vel import QUIET_TIME, CmdVel, Watchdog
from tb3_labs.ros.node import guarded, log_news


class Gate:
    """Guards a core (:mod:`tb3_labs.nodes`) by one lock, which is taken once for each message.

    The command is sent while the lock is held. So commands and stops leave in the order in which
    they were decided: no drive that was decided before a stop follows it. The rest of an Output is
    carried out without the lock, in the same order, by a thread of its own. So a terminal that
    takes no text, a service, or actionlib holds up neither a message nor a look at the clock.
    """

    def __init__(self, tick, at_once=None, carry_out=None, quiet_time=QUIET_TIME):
        """``tick()`` returns the Output of now. ``at_once(output)`` is called with the lock held,
        after the command was sent, and must not wait. ``carry_out(output)`` is called without it.
        """
        self._tick, self._at_once, self._carry_out = tick, at_once, carry_out
        self._lock = threading.Lock()
        self._waiting = queue.Queue()    # Outputs that are not carried out yet
        threading.Thread(target=guarded(self._run), name='gate', daemon=True).start()
        self.cmd_vel = CmdVel()
        self._watchdog = Watchdog(self.look, quiet_time)

    def take_in(self, method, *arguments):
        """Hand over what was heard by ``method(*arguments)`` of the core, and let it decide."""
        with self._lock:
            method(*arguments)
            self._decide()
        self._watchdog.feed()

    def look(self):
        """Let the core look at the clock."""
        with self._lock:
            self._decide()

    def ask(self, method, *arguments):
        """Returns the answer of ``method(*arguments)`` of the core. Nothing is decided: it is a
        question, or a sample that only checks others."""
        with self._lock:
            return method(*arguments)

    def _decide(self):
        """The caller holds the lock."""
        output = self._tick()
        if output.stops_first:
            self.cmd_vel.stop()
        if output.command is not None:
            self.cmd_vel.send(output.command)
        if self._at_once is not None:
            self._at_once(output)
        self._watchdog.keep(output.watched)
        if output.has_more:
            self._waiting.put(output)

    def _run(self):
        while True:
            output = self._waiting.get()
            log_news(output.news)
            if self._carry_out is not None:
                self._carry_out(output)
