"""A checkoff: the parts of a lab, one after the other, with the node that runs."""
import rosgraph
import rospy

from tb3_labs.marking.bench import Falling
from tb3_labs.marking.labs import IMU, LABS
from tb3_labs.marking.topics import IMU as IMU_TOPIC
from tb3_labs.marking.topics import ODOM, TRUTH
from tb3_labs.ros.marking.bench.running_node import NotFound, package_of, process_of
from tb3_labs.ros.marking.bench.scripts import PARTS, PLAYED, RELEASES
from tb3_labs.ros.marking.bench.stage import BenchStage

#: Stands for a package that is not known.
UNKNOWN = 'unknown'


class Impossible(Exception):
    """There can be no checkoff now; the text says why, and what to do."""


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

    def __init__(self, lab, parts, worth, node, person):
        """`worth`: criterion -> points; `node`: its name, '' if any will do. ``Impossible`` if
        there is no robot, or somebody else plays what is played here."""
        self._lab, self._parts, self._person = lab, parts, person
        self._falling = Falling(LABS[lab].criteria, worth, parts)
        self.has_truth = self._look_round()
        self._stage = BenchStage(lab, LABS[lab].listens, lab != IMU, node, self.has_truth, person,
                                 lambda observation: self._say(self._falling.look(observation)))

    @property
    def all_met(self):
        """Is each criterion of the handout met?"""
        return self._falling.all_met

    @property
    def points(self):
        """(points that were earned, full marks of these parts)."""
        return self._falling.points

    @property
    def node(self):
        """The node's name, '' if there was none."""
        return self._stage.node.name

    def run(self):
        """Try all parts; whatever happens, nothing is held afterwards.

        ``Impossible`` if it cannot be told which node is meant.
        """
        try:
            if not self._stage.node.start():
                raise Impossible('no node came that could be judged')
            self._stage.observation.node = '{}/{}'.format(
                package_of(self.node) or UNKNOWN, self.node.rsplit('/', 1)[-1])
            for part in self._parts:
                self._person.tell('\n{}'.format(part.capitalize()))
                self._stage.keep()
                PARTS[self._lab][part](self._stage)
                self._ask(part)
                self._say(self._falling.end(self._stage.observation, part))
        except NotFound as reason:
            raise Impossible(str(reason)) from None
        except rospy.ROSException as problem:
            raise Impossible('the robot is silent: {}'.format(problem)) from None
        finally:
            self._let_go()

    def _ask(self, part):
        """Ask what the node printed, as far as that is not known."""
        observation = self._stage.observation
        for question in self._falling.questions(observation, part):
            if self._person.confirms(question.words):
                for stimulus in observation.stimuli:
                    if stimulus.name == question.stimulus:
                        stimulus.printed += '\n' + question.text

    def _say(self, verdicts):
        for verdict in verdicts:
            self._person.tell(verdict.line)

    def _look_round(self):
        """Does the robot that runs say its true pose?"""
        publishers = {topic: names for topic, names in rosgraph.Master(
            rospy.get_name()).getSystemState()[0]}

        def nodes(topic):
            return [name for name in publishers.get(rospy.resolve_name(topic), [])
                    if name != rospy.get_name() and process_of(name) is not None]
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
        """Release what was held: the mouse, the pad, the control."""
        for topic in {PLAYED.get((self._lab, part)) for part in self._parts} - {None}:
            if self._stage.node.alive:
                RELEASES[topic](self._stage)
