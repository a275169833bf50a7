"""A checkoff: the parts of a lab, one after the other, with a node that a person has started.

Nothing here starts a robot or a node, and nothing leaves a robot moving.
"""
import signal
import subprocess

import rosgraph
import rospy
from roslib.packages import find_node

from tb3_labs.marking.checkoff import OpenCriteria
from tb3_labs.marking.labs import IMU, LABS
from tb3_labs.marking.move2goal import GOAL
from tb3_labs.marking.observation import IMU as IMU_TOPIC
from tb3_labs.marking.observation import ODOM, TRUTH, Observation
from tb3_labs.marking.ros_bench import PARTS, PLAYED, RELEASES
from tb3_labs.marking.ros_robot import Recorder
from tb3_labs.marking.ros_running_node import YES, Impossible, RunningNode, is_there
from tb3_labs.marking.ros_stage import Stage
from tb3_labs.report.messages import RECORDED

#: The bag is closed within this time [s].
CLOSING = 10.0


def parts_of(lab, given):
    """The parts that are tried: those `given`, or all with a criterion of the handout.

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

    def __init__(self, lab, parts, worth, name, person, goal=GOAL):
        """`worth`: criterion -> points; `name`: that of the node, '' if any will do; `goal`:
        as a Stage has it. ``Impossible`` if there is no robot, or somebody else plays the part of
        this program."""
        self._lab, self._parts, self._person = lab, parts, person
        #: The OpenCriteria of these parts.
        self.criteria = OpenCriteria(LABS[lab].criteria, worth, parts)
        self.has_truth = self._look_round()
        self._observation = Observation(lab, '')
        self.node = RunningNode(person, LABS[lab].listens, lab != IMU, name, lambda: recorder.now)
        recorder = Recorder(self._observation, lambda name, address: name in self.node.graph.names,
                            self.has_truth)
        self._stage = Stage(self._observation, recorder, self.node,
                           lambda seen: self._say(self.criteria.look(seen)), goal=goal)

    def run(self):
        """Try all parts; whatever happens, nothing is held afterwards.

        ``Impossible`` if it cannot be told which node is meant.
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
        """Does the robot that runs publish its true pose?"""
        publishers = dict(rosgraph.Master(rospy.get_name()).getSystemState()[0])

        def nodes(topic):
            return [name for name in publishers.get(rospy.resolve_name(topic), [])
                    if name != rospy.get_name() and is_there(name)]
        if not (nodes(IMU_TOPIC) and nodes(ODOM)):
            raise Impossible('no robot runs here: nothing publishes {} and {}; start one first'
                             .format(IMU_TOPIC, ODOM))
        for part in self._parts:
            topic = PLAYED.get((self._lab, part))
            if topic and nodes(topic):
                raise Impossible('{} publishes {}, which is played here: end it first'.format(
                    ', '.join(nodes(topic)), topic))
        return bool(nodes(TRUTH))

    def _let_go(self):
        for topic in {PLAYED.get((self._lab, part)) for part in self._parts} - {None}:
            if self.node.alive:
                RELEASES[topic](self._stage)


class Bag:
    """The bag of a checkoff, which lab_report.py reads; `path` is None if rosbag is not there."""

    def __init__(self, path):
        found = find_node('rosbag', 'record')
        self.path = path if found else None
        self._process = subprocess.Popen(
            [found[0], '--quiet', '-O', str(path)] + [rospy.resolve_name(t) for t in RECORDED],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            start_new_session=True) if found else None

    def close(self):
        """Record no more."""
        if self._process is None:
            return
        self._process.send_signal(signal.SIGINT)
        try:
            self._process.wait(CLOSING)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
