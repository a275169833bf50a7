"""The process of a student's node: found, started, typed to, ended; each run is noted.

Nothing is assumed of the node but the requirements of a handout. Every wait here ends, whatever the
node does.
"""
import difflib
import json
import os
import signal
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Dict, List, Optional

import rospkg
import rospy
from roslib.packages import find_node

from tb3_labs.marking.criteria import START_TIME
from tb3_labs.marking.observation import Run
from tb3_labs.marking.processes import ResourceWatch
from tb3_labs.marking.ros_interface import LISTENS, Graph
from tb3_labs.marking.ros_types import Types
from tb3_labs.marking.sandbox import OWN_FOLDERS, NoSandbox
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.program import NodeProcess

#: A node's file is looked for at these depths of a package; links are followed.
DEPTHS = '*', '*/*', '*/*/*'
#: The variable with the path of the file that holds a Launch: mark.py writes it, since another
#: process, the check, starts the node.
VARIABLE = 'TB3_LABS_LAUNCH'
#: The node dies with the process that tries it out, and leaves the processor to the robot if both
#: want it.
ALWAYS = ['setpriv', '--pdeathsig', 'KILL', 'nice', '-n', '10']
#: A node is ready when it listens to its topic and has registered nothing new for this time; the
#: master is asked every LOOK [s].
QUIET, LOOK = 0.5, 0.1
#: A node gets this time to end before it is killed [s].
PATIENCE = 2.0
#: A sandbox whose program was ended by a signal ends with this number, and the signal's on top.
BY_SIGNAL = 128
#: The line below the print of a node that used too much.
STOPPED = '\nThe marker ended it, since it used {}.\n'
#: This much of the print of a node is kept of a stimulus, and of either end of a run [characters].
PRINTED = 20000


def place_of(package, executable):
    """The path of the file that ``rosrun PACKAGE FILE`` would start.

    ``ValueError`` with the reason, and what to type, if there is none.
    """
    packs = rospkg.RosPack()
    try:
        folder = Path(packs.get_path(package))
    except rospkg.ResourceNotFound:
        raise ValueError('there is no package {} in this terminal{}; build its workspace, and '
                         'type: source devel/setup.bash'.format(
                             package, _near(package, packs.list()))) from None
    found = find_node(package, executable, packs)
    if found:
        return found[0]
    files = [path for depth in DEPTHS for path in sorted(folder.glob(depth)) if path.is_file()]
    for path in files:
        if path.name == executable:
            raise ValueError('{0} is not executable, so rosrun cannot start it; type: chmod +x {0}'
                             .format(path))
    names = sorted({path.name for path in files if path.suffix == '.py'})
    raise ValueError('there is no {} in the package {}, {}{}'.format(
        executable, package, folder, _near(executable, names) or '; there are: {}'.format(
            ', '.join(names[:5]) or 'no Python files')))


def _near(name, known):
    near = difflib.get_close_matches(name, known, 1)
    return ', near it: ' + near[0] if near else ''


@dataclass
class Launch:
    """The start of a node: `prefix`, then its own command."""

    prefix: List[str] = field(default_factory=lambda: ALWAYS + NoSandbox().command([]))
    environment: Optional[Dict[str, str]] = None            # None: that of this process
    types: Optional[Dict[str, Any]] = None      # of the student; see messages_in_sandbox
    isolated: bool = False

    @classmethod
    def given(cls):
        """As mark.py wrote it; without mark.py there is no sandbox."""
        if VARIABLE not in os.environ:
            return cls()
        return cls(**json.loads(Path(os.environ[VARIABLE]).read_text()))


class StudentNode:
    """One process of the node at a time, and a list of Run, the latest last."""

    def __init__(self, package, executable, listens, now):
        """`listens`: the topic that the node must listen to in order to be ready; `now()`: the
        observation's time [s]."""
        self._what, self._listens, self._now = (package, executable), listens, now
        self._launch = Launch.given()
        #: It is called after each run.
        self.on_end = lambda: None
        self._process = self._watch = None
        self.runs = []
        self.graph = Graph(Types(self._launch.types))

    @property
    def alive(self):
        """Does the node run?"""
        return self._process is not None and self._process.status is None

    @property
    def status(self):
        """Its exit status (the negative number of a signal), None while it runs."""
        status = self._process.status
        # a sandbox ends with 128 and the signal that ended its program, as a shell does
        isolated = self._launch.isolated and status is not None and status > BY_SIGNAL
        return BY_SIGNAL - status if isolated else status

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
        environment = self._launch.environment
        if environment is not None:     # each submission has a master of its own
            environment = dict(environment, ROS_MASTER_URI=os.environ['ROS_MASTER_URI'])
        self._process = NodeProcess(*self._what, *arguments, terminal=True,
                                    prefix=self._launch.prefix, environment=environment,
                                    clean=environment is not None)
        if self._launch.isolated:
            self._watch = ResourceWatch(self._process.pid, OWN_FOLDERS)
        if self._is_ready_in_time(topic, known):
            run.ready = self._now()
            return True
        self.stop()
        return False

    def _is_ready_in_time(self, topic, known):
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
        self.on_end()

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
        """The text after the first `characters` that the process printed, as far as it is kept."""
        return self._process.text_since(characters)[-PRINTED:]

    def note(self):
        """Note in the latest run the print of the process, and whether it has ended."""
        if self._process is None:
            return
        text, run = self._process.text, self.runs[-1]
        if len(text) > 2 * PRINTED:
            text = '{}\n...\n{}'.format(text[:PRINTED], text[-PRINTED:])
        if self._watch is not None and self._watch.exceeded:
            text += STOPPED.format(self._watch.exceeded)
        run.printed, run.ended_by_itself = text, not self.alive
