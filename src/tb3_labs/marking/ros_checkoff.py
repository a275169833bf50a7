"""A checkoff: the parts of a lab, one after the other, with a node that a person has started.

Each criterion is judged while the person works. Nothing here starts a robot or a node. The robot is
not left moving. The scripts are like those of the marking, with two differences: a turn begins at
any heading, and the person presses Ctrl+C. Headings are those of the IMU in [deg], 0 to 360.
"""
import time

import rosgraph
import rospy

from tb3_labs.geometry.angles import difference_degrees
from tb3_labs.marking import gamepad, imu, move2goal, ros_gamepad, ros_move2goal, ros_turn, turn
from tb3_labs.marking.marks import GAMEPAD, IMU, LABS, MOVE2GOAL, TURN
from tb3_labs.marking.observation import CTRL_RELINQ
from tb3_labs.marking.observation import IMU as IMU_TOPIC
from tb3_labs.marking.observation import JOY, MOUSE_INFO, MOVED, ODOM, TRUTH, Observation
from tb3_labs.marking.open_criteria import OpenCriteria
from tb3_labs.marking.ros_robot import Recorder, imu_heading_deg
from tb3_labs.marking.ros_running_node import YES, Impossible, RunningNode, is_there, person_ends
from tb3_labs.marking.ros_stage import Stage
from tb3_labs.ros.clocks import wait_until

#: A person types something, and the node answers, within this time together [s].
ANSWER = 4.0
#: The stick is held at this value, so that the robot turns slowly until Ctrl+C.
SLOWLY = 0.3
#: At the end the message that lets go of the robot is sent for this time [s].
RELEASE = 0.4


# -- the scripts that differ from those of the marking

def turns(stage):
    """All turns, in the order of next_turn(); then an invalid input."""
    left, in_vain, step = set(turn.EACH_TURN), 0, None
    for number in range(ros_turn.MOST_TURNS):
        if not stage.node.start():
            return
        step = ros_turn.next_turn(imu_heading_deg(), left, number, step)
        if step is None or in_vain == 2:
            break
        left.discard(step.name)
        if step.name:
            ros_turn.try_turn(stage, step.name, step.typed)
            moved = stage.observation.stimuli[-1].facts[MOVED]
        else:
            stage.node.person.tell('  (This one leads to where the heading jumps.)')
            moved, _ = ros_turn.turn_once(stage, step.typed)
        in_vain = 0 if moved else in_vain + 1
    if not stage.node.start():
        return
    with stage.stimulus(turn.NONSENSE):
        characters, _ = stage.node.printed
        stage.node.type(turn.TYPED_NONSENSE)
        answered = wait_until(lambda: turn.names_valid_inputs(
            stage.node.text_since(characters)), ANSWER)
        if not answered and stage.node.person.asks(
                'Did it answer by an error that names both valid inputs?') == YES:
            stage.node.attest('l, r')


def turn_shutdown(stage):
    """Ctrl+C in a turn."""
    person_ends(stage, 'In the terminal of your node: type l, then Enter, and press Ctrl+C at '
                'once, while it turns.', turn.GOODBYE, lambda: None)


def heading(stage):
    """The marker turns the robot, and the node prints the heading; then Ctrl+C."""
    if not stage.node.start():
        return
    person = stage.node.person
    person.tell('  The robot turns on the spot now: keep clear of it.')
    for name, degrees in imu.STANDS.items():
        stage.robot.face(stage.recorder.heading_deg
                         + difference_degrees(degrees, imu_heading_deg()))
        with stage.stimulus(name, {imu.HEADING_DEG: imu_heading_deg()}):
            characters, _ = stage.node.printed
            if not wait_until(lambda: imu.headings(stage.node.text_since(characters)), 1.0):
                said = person.number('Which heading does your node print now?')
                if said:
                    stage.node.attest('Current heading is {} degrees'.format(said))
    person_ends(stage, 'Press Ctrl+C in the terminal of your node.', imu.GOODBYE)


def drive(stage):
    """The node's frame is reset at the robot's pose, if the node can; then as in the marking."""
    ros_move2goal.Control(stage)
    if not stage.node.start():
        return
    if ros_move2goal.reset_to_origin(stage.node):
        stage.node.person.tell('  The frame was reset here. The robot drives about a metre now: '
                               'keep clear of it.')
    ros_move2goal.drive(stage)


def control(stage):
    """Control is taken in a drive; the person presses Ctrl+C in another drive."""
    ros_move2goal.control_taken(stage, lambda set_in_motion: person_ends(
        stage, 'Press Ctrl+C in the terminal of your node, while the robot drives.',
        set_in_motion=set_in_motion))


def buttons(stage):
    """All is as in the marking, but Ctrl+C comes while the robot turns on the spot."""
    ros_gamepad.buttons(stage, lambda pad: person_ends(
        stage, 'Press Ctrl+C in the terminal of your node, while the robot turns.',
        set_in_motion=lambda: pad.push(left=SLOWLY)))


#: lab -> part -> its script, given a Stage
PARTS = {
    IMU: {imu.HEADING: heading},
    TURN: {turn.TURNS: turns, turn.MOUSE: ros_turn.mouse, turn.BOTH: ros_turn.both,
           turn.SHUTDOWN: turn_shutdown},
    MOVE2GOAL: {move2goal.DRIVE: drive, move2goal.RESET: ros_move2goal.reset,
                move2goal.CONTROL: control, move2goal.DECLARED: ros_move2goal.declared},
    GAMEPAD: dict(ros_gamepad.PARTS, **{gamepad.BUTTONS: buttons}),
}
#: lab -> (topic that this program publishes, parts in which it does; no other program may then)
PLAYED = {TURN: (MOUSE_INFO, {turn.MOUSE, turn.BOTH}),
          MOVE2GOAL: (CTRL_RELINQ, set(PARTS[MOVE2GOAL])), GAMEPAD: (JOY, set(PARTS[GAMEPAD]))}
#: topic -> a function of a Stage that lets go of it: a new mouse is not active, the sticks of a new
#: pad are in the middle, and a new Control has taken the robot from the node
RELEASES = {MOUSE_INFO: lambda stage: ros_turn.mouse_of(stage, []),
            JOY: lambda stage: ros_gamepad.HeldPad(stage.pad), CTRL_RELINQ: ros_move2goal.Control}


# -- the checkoff

def parts_of(lab, given):
    """The parts to try: those `given`, or all that have a criterion of the handout.

    ``ValueError`` for a part that cannot be tried with a node that runs already.
    """
    possible = list(PARTS[lab])
    for part in given:
        if part not in possible:
            raise ValueError('"{}" needs a robot or a node of its own: mark.py tries it. Here: '
                             '{}'.format(part, ', '.join(possible)))
    graded = {criterion.part for criterion in LABS[lab].criteria if not criterion.extra}
    return list(given) or [part for part in possible if part in graded]


class Checkoff:
    """One node, judged while it runs."""

    def __init__(self, lab, parts, worth, name, person, goal):
        """`worth`: criterion -> points; `name`: that of the node, '' if any will do; `goal`:
        as for a Stage. ``Impossible`` if there is no robot, or if another program publishes a topic
        that this program must publish."""
        self._lab, self._parts, self._person = lab, parts, person
        topic, played = PLAYED.get(lab, ('', set()))
        self._played = topic if played.intersection(parts) else ''
        #: The OpenCriteria of these parts.
        self.criteria = OpenCriteria(LABS[lab].criteria, worth, parts)
        self.has_truth = self._look_round()
        self._observation = Observation(lab, '')
        self.node = RunningNode(person, LABS[lab].listens, lab != IMU, name, lambda: recorder.now)
        recorder = Recorder(self._observation, lambda name: name in self.node.graph.names,
                            self.has_truth)
        self._stage = Stage(self._observation, recorder, self.node,
                           lambda seen: self._say(self.criteria.look(seen)), goal=goal)

    def run(self):
        """Try all parts. Afterwards no mouse, pad or control is held, even after an error.

        ``Impossible`` if there is no node, if there are several, or if the robot is silent.
        """
        try:
            if not self.node.start():
                raise Impossible('no node came that could be judged')
            for part in self._parts:
                self._person.tell('\n{}'.format(part.capitalize()))
                self._stage.keep()
                PARTS[self._lab][part](self._stage)
                self._ask(part)
                self._say(self.criteria.end(self._observation, part))
        except rospy.ROSException as problem:
            raise Impossible('the robot is silent: {}'.format(problem)) from None
        finally:
            self._let_go()

    def _ask(self, part):
        for question in self.criteria.questions(self._observation, part):
            if self._person.asks(question.words) == YES:
                for stimulus in self._observation.stimuli:
                    if stimulus.name == question.stimulus:
                        stimulus.printed += '\n' + question.text

    def _say(self, verdicts):
        for verdict in verdicts:
            self._person.tell(verdict.line)

    def _look_round(self):
        """Returns True if the robot publishes its true pose. ``Impossible`` as in __init__()."""
        publishers = dict(rosgraph.Master(rospy.get_name()).getSystemState()[0])

        def nodes(topic):
            return [name for name in publishers.get(rospy.resolve_name(topic), [])
                    if name != rospy.get_name() and is_there(name)]
        if not (nodes(IMU_TOPIC) and nodes(ODOM)):
            raise Impossible('no robot runs here: nothing publishes {} and {}; start one first'
                             .format(IMU_TOPIC, ODOM))
        if self._played and nodes(self._played):
            raise Impossible('{} publishes {}, which is played here: end it first'.format(
                ', '.join(nodes(self._played)), self._played))
        return bool(nodes(TRUTH))

    def _let_go(self):
        if self._played and self.node.alive:
            RELEASES[self._played](self._stage)
            time.sleep(RELEASE)
