"""The stage on which a node is tried out: one robot, one node, and the node's Observation.

The script of a lab's part acts on `node` and `robot` within a :meth:`Stage.stimulus`, and looks at
`recorder`. The node is a StudentNode, which the stage starts and ends, or a RunningNode.
"""
import time
from contextlib import contextmanager

from dynamic_reconfigure.client import Client

from tb3_labs.marking import ros_gamepad, ros_move2goal, ros_turn
from tb3_labs.marking.criteria import (AT_ONCE, CTRL_C, ENDING, SIGNAL, TOOK,
                                       tracebacks_before_the_end)
from tb3_labs.marking.marks import GAMEPAD, IMU, LABS, MOVE2GOAL, TURN
from tb3_labs.marking.move2goal import GOAL
from tb3_labs.marking.observation import WAS_MOVING, Observation, Stimulus
from tb3_labs.marking.ros_robot import ROBOT, UNDER_WAY, WELL_UNDER_WAY, Recorder, RobotHand
from tb3_labs.marking.ros_student_node import StudentNode
from tb3_labs.marking.ros_witness import Witness
from tb3_labs.nodes.pad_config import PadConfig
from tb3_labs.ros.clocks import wait_until

#: An input or a sensor is silent for this time: LOST, plus a margin [s].
SILENCE = 1.5
#: A person has this time to do what is asked [s].
PATIENCE = 60.0
#: lab -> part -> its script, given a Stage
SCRIPTS = {IMU: ros_turn.EXERCISE_PARTS, TURN: ros_turn.PARTS, MOVE2GOAL: ros_move2goal.PARTS,
           GAMEPAD: ros_gamepad.PARTS}


class Stage:
    """One robot, one node, and the node's Observation."""

    def __init__(self, observation, recorder, node, keep, witness=None, pad=PadConfig(),
                 tell=lambda words: None, goal=GOAL):
        """``keep(observation)`` is called after each stimulus and each run; before each call the
        `witness` looks. `pad`: a PadConfig. ``tell(words)`` is called with the present step.
        `goal`: that of move_to_goal, x, y [m], heading [rad]."""
        self.observation, self.recorder, self.node = observation, recorder, node
        self.robot, self.pad, self.goal = RobotHand(recorder), pad, goal
        self._keep, self._witness, self._tell, self._part = keep, witness, tell, ''
        observation.runs, node.on_end = node.runs, self.keep

    def begin(self, part):
        """Begin a part of the lab."""
        self._part = part
        self._tell('{}: the node is started'.format(part))

    @contextmanager
    def stimulus(self, name, facts=None):
        """Record the node's behaviour within the ``with`` block as the stimulus `name`, with these
        `facts`, and those that the block adds."""
        self._tell('{}: {}'.format(self._part, name))
        record = Stimulus(name, self.recorder.now, facts=dict(facts or {}))
        characters, lines = self.node.printed
        yield record
        record.end = self.recorder.now
        record.printed = self.node.text_since(characters)
        record.lines = self.node.printed[1] - lines
        record.died = not self.node.alive
        self.observation.stimuli.append(record)
        self.remark(tracebacks_before_the_end(record))
        self.keep()

    def not_offered(self, names, reason):
        """Note that the node does not offer what these stimuli need."""
        self.observation.missing.update(dict.fromkeys(names, reason))

    def remark(self, sentences):
        """Add these sentences to the remarks for the student, each once."""
        known = self.observation.remarks
        known += [sentence for sentence in sentences if sentence not in known]

    def keep(self):
        """Hand the present Observation to ``keep(observation)``."""
        self.node.note()
        if self._witness is not None:
            self._witness.look()
        self.recorder.hand_to(self._keep)

    # -- patterns that several labs use

    def moves_after(self, act, seconds):
        """Call `act()`. Does the node command a movement within `seconds` [s]?

        If `act()` returns a Person, that person was asked to act: the wait is longer, and the
        person may be asked again.
        """
        begun = self.recorder.now

        def is_over():
            return self.recorder.moves(begun) or not self.node.alive
        person = act()
        while not wait_until(is_over, seconds + (PATIENCE if person else 0.0)):
            if person is None or not person.missed('The robot was not driven. Did you type it?'):
                break
        return self.recorder.moves(begun)

    def set_in_motion(self, is_ready, act, reaction):
        """Have the node move the robot. Returns True in the middle of the motion, False if the
        node does not move the robot, None if the node does not run.

        `is_ready()`: does the node run, and wait? If not, it is started. `act()` should make it
        move within `reaction` [s].
        """
        for _ in range(2):
            if not is_ready() and not self.node.start():
                return None
            if self.moves_after(act, reaction):
                time.sleep(WELL_UNDER_WAY)
                return self.node.alive
            self.node.stop()        # an earlier stimulus may have upset it: start it anew
        return False if self.node.start() else None

    def falls_silent(self, name, was_moving, silence):
        """Record the stimulus of a sensor or an input; `silence()` ends its messages."""
        with self.stimulus(name, {WAS_MOVING: was_moving}):
            silence()
            time.sleep(SILENCE)

    def sensor_falls_silent(self, name, was_moving, switch):
        """Record the stimulus of a silent sensor; the robot's setting `switch` makes it silent."""
        settings = Client(ROBOT, timeout=10.0)      # takes a moment to connect
        self.falls_silent(name, was_moving,
                          lambda: settings.update_configuration({switch: True}))
        settings.update_configuration({switch: False})

    def ctrl_c_in_motion(self, set_in_motion):
        """Send Ctrl+C while the node moves the robot; again if the node sends no zero velocity.

        `set_in_motion()` returns what :meth:`set_in_motion` returns.
        """
        for name in CTRL_C:
            moving = set_in_motion()
            if moving is None:
                return
            begin = self.recorder.now
            self.ctrl_c(name, moving)
            if any(not (linear or angular) and at <= begin + AT_ONCE
                   for at, linear, angular in self.recorder.commands_since(begin)):
                return

    def ctrl_c(self, name=CTRL_C[0], was_moving=False):
        """Send Ctrl+C and wait; afterwards the node has ended in any case."""
        with self.stimulus(name, {WAS_MOVING: was_moving}) as record:
            begin = self.recorder.now
            ended = self.node.interrupt(ENDING)
            record.facts[TOOK] = self.recorder.now - begin if ended else None
            record.facts[SIGNAL] = max(0, -self.node.status) if ended else 0
            time.sleep(UNDER_WAY)
        self.node.stop()



def try_out(lab, package, executable, parts, keep, pad, tell, goal):
    """Start a node and try `parts` of its lab, [] for all of them. Returns the Observation.

    The other arguments are those of Stage.
    """
    observation = Observation(lab, '{}/{}'.format(package, executable))
    recorder = Recorder(observation)
    witness = Witness(observation, recorder.robot, lambda: recorder.hand_to(keep))
    node = StudentNode(package, executable, LABS[lab].listens, lambda: recorder.now)
    stage = Stage(observation, recorder, node, keep, witness, pad, tell, goal)
    try:
        for name, act in SCRIPTS[lab].items():
            if not parts or name in parts:
                stage.begin(name)
                act(stage)
    except Exception as problem:
        # an untried stimulus must not look like a failure of the node
        observation.broken = '{}: {}'.format(type(problem).__name__, problem)
        stage.keep()
        raise
    finally:
        stage.node.stop()
        witness.end()
    return observation
