"""The stage on which a node is tried out: one robot, one node at a time, and what is observed.

A lab's script acts on `node` and `robot` within a :meth:`Stage.stimulus`, and looks at `recorder`.
"""
from contextlib import contextmanager

from tb3_labs.marking.life import (CTRL_C, ENDING, SIGNAL, STOPPING, TOOK,
                                   tracebacks_before_the_end)
from tb3_labs.marking.observation import WAS_MOVING, Observation, Stimulus
from tb3_labs.nodes.pad_config import PadConfig
from tb3_labs.ros.marking.recorder import Recorder
from tb3_labs.ros.marking.robot_hand import RobotHand
from tb3_labs.ros.marking.student_node import StudentNode
from tb3_labs.ros.marking.waiting import wait, wait_until
from tb3_labs.ros.marking.witness import Witness

#: An input or a sensor is silent for this time, LOST and a margin [s].
SILENCE = 1.5
#: What a node sends at its end arrives within this time [s].
UNDER_WAY = 0.2


class Stage:
    """One robot, one node at a time, and the Observation of it."""

    def __init__(self, lab, package, executable, listens, keep=lambda observation: None,
                 pad=PadConfig(), tell=lambda words: None):
        """`listens`: the topic that a node must listen to in order to be ready; `keep` is called
        with the Observation whenever something was completed; `pad`: the PadConfig of the gamepad
        that is played; `tell` hears what is tried now, in words."""
        self.observation = Observation(lab, '{}/{}'.format(package, executable))
        self._keep, self._tell, self._part = keep, tell, ''
        self.pad = pad
        self.recorder = self.make_recorder()
        self.robot = RobotHand(self.recorder)
        self.node = self.make_node(package, executable, listens)
        self.observation.runs = self.node.runs
        self.witness = self.make_witness()

    def make_recorder(self):
        """The Recorder of this stage."""
        return Recorder(self.observation)

    def make_witness(self):
        """The Witness of this stage."""
        return Witness(self.observation, self.recorder.robot,
                       lambda: self.recorder.hand_to(self._keep))

    def make_node(self, package, executable, listens):
        """The StudentNode of this stage."""
        return StudentNode(package, executable, listens, lambda: self.recorder.now, self.keep)

    def begin(self, part):
        """A part of the lab begins."""
        self._part = part
        self._tell('{}: the node is started'.format(part))

    @contextmanager
    def stimulus(self, name, facts=None):
        """Something that is done to the node: what happens within is recorded under `name`, with
        these `facts` and those that the block adds."""
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
        """There cannot be these stimuli, because the node does not offer what they need."""
        for name in names:
            self.observation.missing[name] = reason

    def remark(self, sentences):
        """Tell these sentences on the student's page, each once."""
        known = self.observation.remarks
        known += [sentence for sentence in sentences if sentence not in known]

    def keep(self):
        """Hand the Observation on as it is now."""
        self.node.note()
        self.witness.look()
        self.recorder.hand_to(self._keep)

    # -- patterns that several labs use

    def moves_after(self, act, seconds):
        """Do `act()`; True as soon as the node commands a movement, False after this time [s] or
        at its end."""
        begun = self.recorder.now
        act()
        wait_until(lambda: self.recorder.moves(begun) or not self.node.alive, seconds)
        return self.recorder.moves(begun)

    def set_in_motion(self, is_ready, act, reaction, well_under_way):
        """Have the node move the robot: True in the middle of the motion, False if the node does
        not move it, None if the node does not run.

        `is_ready()`: does the node run, and wait? Else it is started. `act()` should set it in
        motion within `reaction` [s]; the middle is `well_under_way` later [s].
        """
        for _ in range(2):
            if not is_ready() and not self.node.start():
                return None
            if self.moves_after(act, reaction):
                wait(well_under_way)
                return self.node.alive
            self.node.stop()        # whatever was done to it before may be the reason
        return False if self.node.start() else None

    def falls_silent(self, name, was_moving, silence):
        """The stimulus of a sensor or an input that sends no more after `silence()`."""
        with self.stimulus(name, {WAS_MOVING: was_moving}):
            silence()
            wait(SILENCE)

    def sensor_falls_silent(self, name, was_moving, switch):
        """The stimulus of a sensor of the robot that its setting `switch` makes silent."""
        settings = self.robot.settings()
        self.falls_silent(name, was_moving,
                          lambda: settings.update_configuration({switch: True}))
        settings.update_configuration({switch: False})

    def ctrl_c_in_motion(self, set_in_motion):
        """Ctrl+C while the node moves the robot; again if it sends no zero velocity then.

        `set_in_motion()` returns as :meth:`set_in_motion` does.
        """
        for name in CTRL_C:
            moving = set_in_motion()
            if moving is None:
                return
            begin = self.recorder.now
            self.ctrl_c(name, moving)
            if any(not (linear or angular)
                   for time, linear, angular in self.recorder.commands_since(begin)
                   if time <= begin + STOPPING):
                return

    def ctrl_c(self, name=CTRL_C[0], was_moving=False):
        """Ctrl+C, and what comes of it; the node has ended afterwards."""
        with self.stimulus(name, {WAS_MOVING: was_moving}) as record:
            begin = self.recorder.now
            ended = self.node.interrupt(ENDING)
            record.facts[TOOK] = self.recorder.now - begin if ended else None
            record.facts[SIGNAL] = max(0, -self.node.status) if ended else 0
            wait(UNDER_WAY)
        self.node.stop()
