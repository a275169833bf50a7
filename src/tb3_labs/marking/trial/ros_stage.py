"""The stage on which a node is tried out: one robot, one node, and the node's Observation.

The script of a lab's part acts on `node` and `robot` within a :meth:`Stage.stimulus`, and looks at
`recorder`. A Witness looks for programs that would make the marks wrong.
"""
import os
import threading
import time
from contextlib import contextmanager, suppress

import rosgraph
import rospkg
import rospy
from dynamic_reconfigure.encoding import decode_config, encode_config
from dynamic_reconfigure.msg import Config as Values
from dynamic_reconfigure.srv import Reconfigure

from tb3_labs.marking.intake.sandbox import OWN_PACKAGE
from tb3_labs.marking.intake.workspace import Launch
from tb3_labs.marking.labs import ros_gamepad, ros_move2goal, ros_turn
from tb3_labs.marking.labs.criteria import AT_ONCE, ENDING, LOST_AFTER, SIGNAL, TOOK
from tb3_labs.marking.trial.evidence import CTRL_C
from tb3_labs.marking.lab_names import GAMEPAD, IMU, MOVE2GOAL, NODES, TURN
from tb3_labs.marking.trial.observation import (
    LONGEST, TRUTH, WAS_MOVING, NotOffered, NotTried, Observation, Stimulus)
from tb3_labs.marking.trial.program_text import text_of
from tb3_labs.marking.trial.ros_robot import (
    ROBOT, SWITCHES, UNDER_WAY, WELL_UNDER_WAY, Recorder, RobotHand)
from tb3_labs.marking.trial.ros_student_node import StudentNode
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.topics import subscribe

ENDED = 'The {} was ended while the node ran.'
#: lab -> part -> its script, given a Stage
SCRIPTS = {IMU: ros_turn.EXERCISE_PARTS, TURN: ros_turn.PARTS, MOVE2GOAL: ros_move2goal.PARTS,
           GAMEPAD: ros_gamepad.PARTS}


class Stage:
    """One robot, one node, and the node's Observation."""

    def __init__(self, lab, package, executable, keep, pad, tell):
        """``keep(observation)`` is called after each stimulus and each run. `pad`: a PadConfig.
        ``tell(words)`` is called with the present step."""
        self.observation = Observation(lab, '{}/{}'.format(package, executable))
        self.recorder = Recorder(self.observation)
        self.robot, self.pad, self.part = RobotHand(self.recorder), pad, ''
        self.witness = Witness(self.observation, self.recorder.robot,
                               lambda: self.recorder.hand_to(keep))
        self.node = StudentNode(self.observation, NODES[lab].sensors, lambda: self.recorder.now,
                                self.keep)
        self._keep, self._tell, self._slip = keep, tell, 0.0

    @contextmanager
    def stimulus(self, name, facts=None):
        """Record the node's behaviour within the ``with`` block as the stimulus `name`, with these
        `facts`, and those that the block adds."""
        self._tell('{}: {}'.format(self.part, name))
        record = Stimulus(name, self.recorder.now, facts=dict(facts or {}))
        characters, lines = self.node.printed
        yield record
        record.end = self.recorder.now
        record.printed = self.node.text_since(characters)
        record.lines = self.node.printed[1] - lines
        record.died = not self.node.alive
        self.observation.stimuli.append(record)
        self.keep()

    def watch(self, name, seconds, act=lambda: None, facts=None):
        """Record `act()` and the `seconds` [s] after it as the stimulus `name`, with `facts`."""
        with self.stimulus(name, facts):
            act()
            time.sleep(seconds)

    def text(self, *packages):
        """What the text of the submission shows, else that of these packages; see program_text."""
        known = rospkg.RosPack()
        folders = [known.get_path(name) for name in {self.observation.node.split('/')[0], *packages}
                   if name != OWN_PACKAGE and name in known.list()]
        return text_of([Launch.given().copy] if Launch.given().copy else folders)

    def not_offered(self, names, reason):
        """End the part by ``NotOffered``: the node does not offer what these stimuli need."""
        self.observation.missing.update(dict.fromkeys(names, reason[:LONGEST]))
        raise NotOffered(reason)

    def remark(self, sentences):
        """Add these sentences to the remarks for the student, each once."""
        known = self.observation.remarks
        known += [sentence[:LONGEST] for sentence in sentences if sentence[:LONGEST] not in known]

    def keep(self):
        """Hand the present Observation to ``keep(observation)``."""
        self.node.note()
        self.witness.look()
        self.recorder.hand_to(self._keep)

    # -- patterns that several labs use

    def moves_after(self, act, seconds):
        """Call `act()`. Does the node command a movement within `seconds` [s]?"""
        begun = self.recorder.now
        act()
        wait_until(lambda: self.recorder.moves(begun) or not self.node.alive, seconds)
        return self.recorder.moves(begun)

    def set_in_motion(self, is_ready, act, reaction):
        """Have the node move the robot. Returns True in the middle of the motion, False if the
        node does not move the robot.

        `is_ready()`: does the node run, and wait? If not, it is started. `act()` should make it
        move within `reaction` [s].
        """
        for _ in range(2):
            if not is_ready():
                self.node.start()
            if self.moves_after(act, reaction):
                time.sleep(WELL_UNDER_WAY)
                return self.node.alive
            self.node.stop()        # an earlier stimulus may have upset it: start it anew
        self.node.start()
        return False

    def falls_silent(self, name, was_moving, silence):
        """Record the stimulus of a sensor or an input; `silence()` ends its messages."""
        self.watch(name, LOST_AFTER + 0.5, silence, {WAS_MOVING: was_moving})

    def sensor_falls_silent(self, name, was_moving, switch):
        """Record the stimulus of a silent sensor; the robot's setting `switch` makes it silent."""
        self.falls_silent(name, was_moving, lambda: configure_robot({switch: True}))
        configure_robot({switch: False})

    def set_slip(self, share):
        """From now on the wheels lose this share of their travel. A node may take a sudden change
        for a fault of its sensors: it is ended before."""
        if share != self._slip:
            self.node.stop()
            self.witness.change(slip=share)
            self._slip = share

    def ctrl_c_in_motion(self, set_in_motion):
        """Send Ctrl+C while the node moves the robot; again if the node sends no zero velocity.

        `set_in_motion()` returns what :meth:`set_in_motion` returns.
        """
        for name in CTRL_C:
            moving, begin = set_in_motion(), self.recorder.now
            self.ctrl_c(name, moving)
            if any(not (linear or angular) and at <= begin + AT_ONCE
                   for at, linear, angular in self.recorder.commands_since(begin)):
                return

    def ctrl_c(self, name=CTRL_C[0], was_moving=False):
        """Send Ctrl+C and wait; afterwards the node has ended in any case."""
        with self.stimulus(name, {WAS_MOVING: was_moving}) as record:
            begin = self.recorder.now
            ended = self.node.interrupt(ENDING)
            if not (ended or was_moving):   # Python 3.13 ends when input() does, which awaits Enter
                self.node.type('')
                ended = wait_until(lambda: not self.node.alive, AT_ONCE)
            record.facts[TOOK] = self.recorder.now - begin if ended else None
            record.facts[SIGNAL] = max(0, -self.node.status) if ended else 0
            time.sleep(UNDER_WAY)
        self.node.stop()


class Witness:
    """Notes in an Observation, for the instructor, what would make its marks wrong, until `end()`.

    Such as a program that reads the robot's true pose, or changes the robot's settings: these are
    set back.
    """

    def __init__(self, observation, robot, keep):
        """`robot`: the address of the robot; ``keep()`` saves the present Observation."""
        self._observation, self._robot, self._keep = observation, robot, keep
        self._master = rosgraph.Master(rospy.get_name())
        #: The connection to the master allows only one question at a time.
        self._asking = threading.Lock()
        self._settings, self._repairs = None, 0
        self._over = threading.Event()
        subscribe('/{}/parameter_updates'.format(ROBOT), Values, self._on_settings, queue_size=None)
        rospy.on_shutdown(self._on_shutdown)
        threading.Thread(target=self._repeat, daemon=True).start()

    def end(self):
        """Look once more, then end."""
        if not self._over.is_set():
            self.look()
            self._over.set()

    def look(self):
        """Ask the master once; if it does not answer, nothing is noted."""
        with self._asking, suppress(OSError, rosgraph.MasterException):
            for topic, nodes in self._master.getSystemState()[1]:
                if topic in (rospy.resolve_name(TRUTH), '/' + TRUTH):
                    for node in set(nodes) - {rospy.get_name()}:
                        self._observation.note('{} listens to {}, which tells the true pose.'
                                               .format(node, topic))
            try:
                address = self._master.lookupNode('/' + ROBOT)
            except rosgraph.MasterError:
                address = ''
            self._observation.note(ENDED.format('robot') if address != self._robot else '')

    def change(self, **settings):
        """Change settings of the robot, by the marker itself."""
        if self._settings is not None:
            self._settings.update(settings)
        configure_robot(settings)

    def _repeat(self):
        while not self._over.wait(1.0):
            self.look()

    def _on_settings(self, message):
        """Set back the settings that the marker did not change."""
        now = decode_config(message)
        if self._settings is None:
            self._settings = now
        findings = changed(self._settings, now)
        for finding in findings:
            self._observation.note(finding)
        if findings and self._repairs < 20:     # not against a program without end
            self._repairs += 1
            with suppress(rospy.ServiceException):      # the robot is gone: noted elsewhere
                configure_robot({name: value for name, value in self._settings.items()
                                 if name not in SWITCHES})

    def _on_shutdown(self):
        """End at once: a marker that was shut down hears nothing, and would observe wrongly."""
        if not self._over.is_set():
            self._observation.note(ENDED.format('marker'))
            self._keep()
            os._exit(1)


def configure_robot(settings):
    """Change these settings of the robot: name -> value."""
    rospy.ServiceProxy('/{}/set_parameters'.format(ROBOT), Reconfigure)(encode_config(settings))


def changed(before, now):
    """The findings on changed settings of the robot, except SWITCHES."""
    return ['A setting of the robot was changed: {} from {} to {}.'.format(
        name, before.get(name, 'none'), now.get(name, 'none'))
        for name in sorted(set(before) | set(now))
        if name not in SWITCHES and before.get(name) != now.get(name)]


def try_out(lab, package, executable, parts, keep, pad, tell):
    """Start a node and try `parts` of its lab, [] for all of them. Returns the Observation.

    The other arguments are those of Stage.
    """
    stage = Stage(lab, package, executable, keep, pad, tell)
    try:
        for name, act in SCRIPTS[lab].items():
            if not parts or name in parts:
                stage.part = name
                stage.set_slip(0.0)
                tell('{}: the node is started'.format(name))
                with suppress(NotOffered, NotTried):    # the rest of the part cannot be tried
                    act(stage)
    except Exception as problem:
        # an untried stimulus must not look like a failure of the node
        stage.observation.broken = '{}: {}'.format(type(problem).__name__, problem)[:LONGEST]
        stage.keep()
        raise
    finally:
        stage.node.stop()
        stage.witness.end()
    return stage.observation
