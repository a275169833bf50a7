"""The process of a student's node: started, typed to, ended; each run is noted.

Nothing is assumed of the node but what a handout asks for. Every wait here ends, whatever the node
does.
"""
import signal
import time

import rospy

from tb3_labs.marking.life import START_TIME
from tb3_labs.marking.observation import Run
from tb3_labs.ros.marking.box import OWN_FOLDERS
from tb3_labs.ros.marking.graph import LISTENS, Graph
from tb3_labs.ros.marking.launch import Launch
from tb3_labs.ros.marking.limits import Watch
from tb3_labs.ros.marking.types import Types
from tb3_labs.ros.marking.waiting import wait_until
from tb3_labs.ros.program import NodeProcess

#: A node is ready when it listens to its topic and has registered nothing new for this time; the
#: master is asked every LOOK [s].
QUIET = 0.5
LOOK = 0.1
#: A node gets this time to end before it is killed [s].
PATIENCE = 2.0
#: A box whose program was ended by a signal ends with this number, and the signal's on top.
BY_SIGNAL = 128
#: What stands below the print of a node that used too much.
STOPPED = '\nThe marker ended it, since it used {}.\n'
#: Of what a node printed, this much is kept of a stimulus, and of either end of a run [characters].
PRINTED = 20000


class StudentNode:
    """One process of the node at a time, and a list of Run, the latest last."""

    def __init__(self, package, executable, listens, now, ended):
        """`listens`: the topic that the node must listen to in order to be ready; `now()`: the
        observation's time [s]; `ended()` is called after each run."""
        self._what, self._listens = (package, executable), listens
        self._launch = Launch.given()
        self._now, self._ended = now, ended
        self._process = self._watch = None
        self.runs = []
        #: What the master knows of the node.
        self.graph = Graph(Types(self._launch.types))

    @property
    def alive(self):
        """Does the node run?"""
        return self._process is not None and self._process.status is None

    @property
    def status(self):
        """Its exit status (the negative number of a signal), None while it runs."""
        status = self._process.status
        # a box ends with 128 and the signal that ended its program, as a shell does
        boxed = self._launch.boxed and status is not None and status > BY_SIGNAL
        return BY_SIGNAL - status if boxed else status

    def start(self, *arguments, listens=None):
        """Start the node anew; True as soon as it is ready.

        Once it never was ready, it is not tried again.
        """
        topic = rospy.resolve_name(listens or self._listens)
        self.stop()
        if self.runs and self.runs[0].ready is None:
            return False
        known = set(self.graph.nodes())
        run = Run(self._now())
        self.runs.append(run)
        environment = self._launch.in_this_world()
        self._process = NodeProcess(*self._what, *arguments, terminal=True,
                                    prefix=self._launch.prefix, environment=environment,
                                    clean=environment is not None)
        self._watch = Watch(self._process.pid, OWN_FOLDERS) if (
            self._launch.boxed) else None
        if self._is_ready_in_time(topic, known):
            run.ready = self._now()
            return True
        self.stop()
        return False

    def _is_ready_in_time(self, topic, known):
        """Wait for what the process registers with the master; `known`: names of other nodes."""
        new, since = {}, time.monotonic()

        def is_ready():
            nonlocal new, since
            seen = {name: registered for name, registered in self.graph.nodes().items()
                    if name not in known}
            if seen != new:
                new, since = seen, time.monotonic()
            return any((LISTENS, topic) in registered for registered in new.values()) and (
                time.monotonic() - since >= QUIET)
        ready = wait_until(lambda: not self.alive or is_ready(), START_TIME, LOOK)
        self.graph.names = set(new)
        return ready and self.alive

    def stop(self):
        """End the node, whatever it does."""
        if self._process is None:
            return
        ended = not self.alive
        self.interrupt(PATIENCE)
        self._process.kill()
        if self._watch is not None:
            self._watch.end()
        self.note()
        self.runs[-1].end, self.runs[-1].ended_by_itself = self._now(), ended
        self._process = None
        self.graph.forget()
        self._ended()

    def interrupt(self, seconds):
        """Ctrl+C; True as soon as the node has ended, False after this time [s]."""
        self._process.send(signal.SIGINT)
        return wait_until(lambda: not self.alive, seconds)

    def type(self, line):
        """Type a line, and Enter."""
        try:
            self._process.type(line)
        except OSError:
            pass    # the node has ended, which is recorded

    @property
    def printed(self):
        """How much the process printed so far: (characters, lines)."""
        return self._process.printed

    def text_since(self, characters):
        """What the process printed after so many characters, as far as it is kept."""
        return self._process.text_since(characters)[-PRINTED:]

    def note(self):
        """Note in the latest run what the process printed, and whether it has ended."""
        if self._process is None:
            return
        text, run = self._process.text, self.runs[-1]
        if len(text) > 2 * PRINTED:
            text = '{}\n...\n{}'.format(text[:PRINTED], text[-PRINTED:])
        if self._watch is not None and self._watch.exceeded:
            text += STOPPED.format(self._watch.exceeded)
        run.printed, run.ended_by_itself = text, not self.alive
