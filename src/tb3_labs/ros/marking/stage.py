"""Where a node is tried out: starts and stops it, moves the robot, records what happens.

Nothing is assumed of the node but what a handout asks for; whatever it does, every wait here ends.
"""
import math
import signal
import threading
import time
from contextlib import contextmanager

import rospy
from dynamic_reconfigure.client import Client
from geometry_msgs.msg import PoseStamped, Twist

from tb3_labs.control.speed_laws import clamp
from tb3_labs.geometry.angles import continuous, difference
from tb3_labs.marking.life import CTRL_C, ENDING, STOPPING
from tb3_labs.marking.observation import Observation, Run, Stimulus
from tb3_labs.ros.conversions import to_pose2, to_twist
from tb3_labs.ros.marking.graph import Graph
from tb3_labs.ros.testing.node_process import NodeProcess
from tb3_labs.ros.topics import subscribe

#: The node dies with whoever tries it out, writes no file larger than 50 MB, and leaves the
#: processor to the robot where both want it.
GUARD = ('setpriv', '--pdeathsig', 'KILL', 'prlimit', '--fsize=50000000', 'nice', '-n', '10')
#: A node has so long to get ready [s], and is ready when it has registered nothing new for QUIET.
START_TIME = 15.0
QUIET = 0.5
#: A node that is in the way gets so long to end before it is killed [s].
PATIENCE = 2.0
#: Of equal commands in a row one is kept each so often [s].
SAME_COMMAND = 0.04
#: No more commands than this are kept of a node.
MOST_COMMANDS = 40000
#: So much of what a node printed is kept, of a stimulus and of a run [characters].
PRINTED = 20000
#: A robot that moves less than this within REST_TIME rests [m], [rad], [s].
REST_WAY = 0.002
REST_TURN = 0.005
REST_TIME = 0.4


class Stage:
    """One robot, one node at a time, and the Observation of it."""

    def __init__(self, lab, package, executable, listens, keep=lambda observation: None):
        """`listens`: the topic a node must listen to in order to be ready; `keep` is called with
        the Observation whenever something was completed."""
        self.observation = Observation(lab, '{}/{}'.format(package, executable))
        self.node = None
        self._what = package, executable
        self._listens = listens
        self._keep = keep
        self._zero = rospy.get_time()
        self._lock = threading.Lock()
        #: What the master knows of the node.
        self.graph = Graph()
        self._wheels = rospy.Publisher('cmd_vel', Twist, queue_size=1)
        subscribe('ground_truth', PoseStamped, self._on_truth)
        subscribe('cmd_vel', Twist, self._on_command)
        if not self.wait_until(lambda: self.observation.truth, START_TIME):
            raise RuntimeError('the embedded robot does not run')

    # -- what is recorded

    @property
    def now(self):
        """Seconds since the stage was set up."""
        return rospy.get_time() - self._zero

    def _on_truth(self, message):
        pose, truth = to_pose2(message.pose), self.observation.truth
        with self._lock:
            yaw = continuous(pose.yaw, truth[-1][3]) if truth else pose.yaw
            truth.append([self.now, pose.x, pose.y, yaw])

    def _on_command(self, message):
        if message._connection_header['callerid'] == rospy.get_name():
            return
        entry, commands = [self.now, message.linear.x, message.angular.z], self.observation.commands
        if not (math.isfinite(entry[1]) and math.isfinite(entry[2])):
            return
        with self._lock:
            same = commands and commands[-1][1:] == entry[1:]
            if len(commands) < MOST_COMMANDS and not (
                    same and entry[0] - commands[-1][0] < SAME_COMMAND):
                commands.append(entry)

    @contextmanager
    def stimulus(self, name, **facts):
        """Something that is done to the node: what happens within is recorded under `name`."""
        record = Stimulus(name, self.now, facts=facts)
        characters, lines = self.node.printed
        yield record
        record.end = self.now
        record.printed = self.node.text_since(characters)[-PRINTED:]
        record.lines = self.node.printed[1] - lines
        record.died = self.node.status is not None
        self.observation.stimuli.append(record)
        self.keep()

    def not_offered(self, name, reason):
        """There can be no such stimulus, because the node does not offer what it takes."""
        self.observation.missing[name] = reason

    def keep(self):
        """Hand the Observation on as it is now."""
        if self.node is not None and self.observation.runs:
            self._note_run()
        with self._lock:
            self._keep(self.observation)

    # -- the node

    def start(self, *arguments, listens=None):
        """Start the node anew; True as soon as it is ready, which means that it listens to
        `listens`. Once it never was ready, it is not tried again."""
        topic = rospy.resolve_name(listens or self._listens)
        self.stop()
        runs = self.observation.runs
        if runs and runs[0].ready is None:
            return False
        known = set(self.graph.nodes())
        runs.append(Run(self.now))
        self.node = NodeProcess(*self._what, *arguments, terminal=True, prefix=GUARD)
        seen, since = None, time.monotonic()

        def is_ready():
            nonlocal seen, since
            new = {name: topics for name, topics in self.graph.nodes().items()
                   if name not in known}
            if new != seen:
                seen, since = new, time.monotonic()
            return any(topic in topics for topics in new.values()) and (
                time.monotonic() - since >= QUIET)
        ready = self.wait_until(lambda: not self.alive or is_ready(), START_TIME) and self.alive
        self.graph.names = set(seen or ())
        runs[-1].ready = self.now if ready else None
        if not ready:
            self.stop()
        return ready

    @property
    def alive(self):
        """Does the node run?"""
        return self.node is not None and self.node.status is None

    def stop(self):
        """End the node, whatever it does."""
        if self.node is None:
            return
        ended = self.node.status is not None
        self.node.send(signal.SIGINT)
        self.wait_until(lambda: not self.alive, PATIENCE)
        self.node.kill()
        run = self.observation.runs[-1]
        self._note_run()
        run.end, run.ended_by_itself = self.now, ended
        self.node = None
        self.graph.forget()
        self.keep()

    def _note_run(self):
        printed, run = self.node.text, self.observation.runs[-1]
        if len(printed) > 2 * PRINTED:
            printed = '{}\n...\n{}'.format(printed[:PRINTED], printed[-PRINTED:])
        run.printed, run.ended_by_itself = printed, self.node.status is not None

    def type(self, line):
        """Type a line, and Enter."""
        try:
            self.node.type(line)
        except OSError:
            pass    # the node has ended, which is recorded

    def set_in_motion(self, is_ready, begin, reaction, well_under_way):
        """True in the middle of a motion, False if the node does not move, None if it does not run.

        `is_ready()`: does it run, and wait? Else it is started. `begin()` should set it in motion,
        within `reaction` [s]; in the middle is `well_under_way` later [s].
        """
        for _ in range(2):
            if not is_ready() and not self.start():
                return None
            begun = self.now
            begin()
            if self.wait_until(lambda: self.moves(begun) or not self.alive, reaction):
                self.wait(well_under_way)
                return self.alive
            self.stop()        # whatever was done to it before may be the reason
        return False if self.start() else None

    def silence(self, name, switch, was_moving):
        """A sensor of the embedded robot falls silent for a while, by its `switch`."""
        robot = Client('turtlebot3', timeout=10.0)
        with self.stimulus(name, was_moving=was_moving):
            robot.update_configuration({switch: True})
            self.wait(2.0)
        robot.update_configuration({switch: False})

    def ctrl_c_in_motion(self, set_in_motion):
        """Ctrl+C while the node moves the robot, again where it sends no zero then.

        `set_in_motion()` brings that about: True if it moves, False if not, None if it does not
        run."""
        for name in CTRL_C:
            moving = set_in_motion()
            if moving is None:
                return
            begin = self.now
            self.ctrl_c(name, moving)
            if any(not (linear or angular) for time, linear, angular in self.commands_since(begin)
                   if time <= begin + STOPPING):
                return

    def ctrl_c(self, name=CTRL_C[0], was_moving=False):
        """Ctrl+C, and what comes of it; the node has ended afterwards."""
        with self.stimulus(name, was_moving=was_moving) as record:
            begin = self.now
            self.node.send(signal.SIGINT)
            ended = self.wait_until(lambda: not self.alive, ENDING)
            record.facts['took'] = self.now - begin if ended else None
            record.facts['signal'] = max(0, -self.node.status) if ended else 0
            self.wait(0.2)     # what is under way
        self.stop()

    # -- waiting, and the robot

    def wait(self, seconds):
        """Let time go by."""
        rospy.rostime.wallsleep(seconds)

    def wait_until(self, condition, seconds):
        """True as soon as `condition()` holds, False after so many seconds."""
        deadline = time.monotonic() + seconds
        while not condition():
            if time.monotonic() >= deadline:
                return False
            time.sleep(0.02)
        return True

    @property
    def pose(self):
        """Where the robot truly is: (x, y, yaw), the yaw continuous."""
        with self._lock:
            return tuple(self.observation.truth[-1][1:])

    @property
    def heading_deg(self):
        """Where the robot truly looks [deg], continuous."""
        return math.degrees(self.pose[2])

    def commands_since(self, begin):
        """The node's commands since `begin`: [time, linear, angular]."""
        with self._lock:
            return [entry for entry in self.observation.commands if entry[0] >= begin]

    def moves(self, begin):
        """Has the node commanded a movement since `begin`?"""
        return any(linear or angular for _, linear, angular in self.commands_since(begin))

    def rests(self):
        """Has the robot been at rest for a while?"""
        with self._lock:
            recent = [row for row in self.observation.truth[-200:]
                      if row[0] >= self.now - REST_TIME]
        if len(recent) < 5:
            return False
        ways = [math.hypot(row[1] - recent[0][1], row[2] - recent[0][2]) for row in recent]
        turns = [abs(row[3] - recent[0][3]) for row in recent]
        return max(ways) < REST_WAY and max(turns) < REST_TURN

    def wait_for_rest(self, seconds):
        """True as soon as the robot rests."""
        return self.wait_until(self.rests, seconds)

    def face(self, heading_deg, seconds=8.0):
        """Turn the robot to a heading, the short way, by commands of this stage."""
        def error():
            return difference(math.radians(heading_deg), self.pose[2])
        deadline = time.monotonic() + seconds
        while abs(error()) > 0.01 and time.monotonic() < deadline:
            rate = clamp(3.0 * error(), -1.5, 1.5)
            self._wheels.publish(to_twist(0.0, math.copysign(max(abs(rate), 0.1), rate)))
            self.wait(0.03)
        self._wheels.publish(to_twist(0.0, 0.0))
        self.wait_for_rest(2.0)
