"""The stage at the bench: the robot and the node that run, and a person between the two."""
from tb3_labs.marking.life import CTRL_C, SIGNAL, STOPPING, TOOK, TRACEBACK_LINE
from tb3_labs.marking.observation import WAS_MOVING, Stimulus
from tb3_labs.ros.conversions import to_twist
from tb3_labs.ros.marking.bench.recorder import BenchRecorder, imu_heading_deg
from tb3_labs.ros.marking.bench.running_node import RunningNode
from tb3_labs.ros.marking.robot_hand import RobotHand
from tb3_labs.ros.marking.stage import UNDER_WAY, Stage
from tb3_labs.ros.marking.witness import NoWitness
from tb3_labs.ros.marking.waiting import wait, wait_until

#: A person does what is asked within this time [s].
PATIENCE = 60.0
#: A node that commanded a movement so shortly before its end was ended in that movement [s].
IN_MOTION = 0.5


class BenchHand(RobotHand):
    """As RobotHand; the robot stands afterwards, also if it was interrupted."""

    def face(self, heading_deg, seconds=8.0):
        try:
            super().face(heading_deg, seconds)
        finally:
            self._wheels.publish(to_twist(0.0, 0.0))


class BenchStage(Stage):
    """As Stage, for a node that a person has started and types to."""

    def __init__(self, lab, listens, drives, name, has_truth, person, keep):
        """`name`: of the node, '' if any will do; `has_truth`: does the robot say its true pose?"""
        self.person = person
        self._wanted, self._has_truth = (drives, name), has_truth
        super().__init__(lab, '', '', listens, keep)
        self.robot = BenchHand(self.recorder)

    def make_recorder(self):
        return BenchRecorder(self.observation, lambda sender: self.node.is_it(sender),
                             self._has_truth)

    def make_witness(self):
        return NoWitness()

    def make_node(self, package, executable, listens):
        return RunningNode(self.person, listens, *self._wanted, lambda: self.recorder.now)

    @staticmethod
    def heading_deg():
        """The heading that the IMU says now, 0 to 360 [deg]."""
        return imu_heading_deg()

    def moves_after(self, act, seconds):
        """As Stage's; a person who was asked for something by `act` gets time for it."""
        tasks = self.person.tasks
        begun = self.recorder.now
        act()
        seconds += PATIENCE if self.person.tasks > tasks else 0.0
        wait_until(lambda: self.recorder.moves(begun) or not self.node.alive, seconds)
        return self.recorder.moves(begun)

    def ctrl_c_in_motion(self, set_in_motion):
        """Later: see :meth:`ended_in_motion`, which lets a person do it without haste."""

    def ended_in_motion(self, task, set_in_motion, goodbye=''):
        """Ctrl+C by the person while the node moves the robot; again if it did not move then.

        `task`: what the person is asked for; ``set_in_motion()`` is called before; `goodbye`: what
        the node says at its end.
        """
        for name in CTRL_C:
            if not self.node.start():
                return
            set_in_motion()
            self.person.have(task)
            if not self._ended(name, goodbye) or self.observation.stimuli[-1].facts[WAS_MOVING]:
                return
            self.person.tell('  The robot was not moving when the node ended.')

    def ended(self, goodbye=''):
        """Ctrl+C by the person."""
        self.person.have('Press Ctrl+C in the terminal of your node.')
        self._ended(CTRL_C[0], goodbye)

    def _ended(self, name, goodbye):
        """The stimulus of a Ctrl+C, whose moment is known from what came of it; False if there was
        none."""
        asked = self.recorder.now
        characters, lines = self.node.printed
        if not wait_until(lambda: not self.node.alive, PATIENCE) and not self.person.confirms(
                'The node still runs. Did you press Ctrl+C?'):
            return False
        ended = not self.node.alive
        wait(UNDER_WAY)
        gone = self.node.gone_at if ended else self.recorder.now
        moving = [time for time, linear, angular in self.recorder.commands_since(asked)
                  if linear or angular]
        in_motion = bool(moving) and gone - moving[-1] < IN_MOTION
        begin = moving[-1] if in_motion else max(asked, gone - STOPPING)
        self._ask_what_it_printed(characters, goodbye if name == CTRL_C[0] else '', ended)
        self.observation.stimuli.append(Stimulus(
            name, begin, self.recorder.now, self.node.text_since(characters),
            self.node.printed[1] - lines, ended,
            {WAS_MOVING: in_motion, TOOK: gone - begin if ended else None, SIGNAL: 0}))
        self.node.runs[-1].ended_by_itself = False
        self.keep()
        return True

    def _ask_what_it_printed(self, characters, goodbye, ended):
        if goodbye and goodbye not in self.node.text_since(characters) and self.person.confirms(
                'Did it print "{}"?'.format(goodbye)):
            self.node.attest(goodbye)
        if ended and self.person.denies('Did it end without a traceback in its terminal?'):
            self.node.attest(TRACEBACK_LINE)
