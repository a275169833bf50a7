"""A checkoff: the parts of a lab, one after the other, with a node that a person has started.

Each criterion is judged while the person works. Nothing here starts a robot or a node. The robot is
not left moving.
"""
import signal
import subprocess
from typing import Iterable, List, Mapping, NamedTuple, Sequence, Tuple

import rosgraph
import rospy
from roslib.packages import find_node

from tb3_labs.marking import gamepad, move2goal
from tb3_labs.marking.criteria import Criterion, Outcome, Verdict, judge
from tb3_labs.marking.marks import IMU, LABS, Marks
from tb3_labs.marking.observation import IMU as IMU_TOPIC
from tb3_labs.marking.observation import ODOM, TRUTH, Observation, Scene
from tb3_labs.marking.ros_bench import PARTS, PLAYED, RELEASES
from tb3_labs.marking.ros_robot import Recorder
from tb3_labs.marking.ros_running_node import YES, Impossible, RunningNode, is_there
from tb3_labs.marking.ros_stage import Stage
from tb3_labs.report.messages import RECORDED

#: The bag is closed within this time [s].
CLOSING = 10.0


# -- criteria that are open

class Question(NamedTuple):
    """A question to a person about a stimulus; a yes means that the node printed `text`."""

    stimulus: str
    words: str
    text: str


#: Only a person sees a node's output. Name of a criterion about the output -> Question.
QUESTIONS = {
    'says_reached': Question(move2goal.AT_GOAL, 'Did it print "Goal reached!", once?',
                             'Goal reached!'),
    'says_reset': Question(move2goal.RESET_TO_ORIGIN, 'Did it print "Local pose set to x=..., '
                           'y=..., yaw=..."?', 'Local pose set'),
    'says_success': Question(gamepad.RESET, 'Did it print "{}." after Y?'.format(gamepad.SUCCESS),
                             gamepad.SUCCESS),
    'says_why_not': Question(gamepad.RESET_WITHOUT_SERVICE, 'Did it say why the reset failed?',
                             'why'),
}


class Pending(Exception):
    """A criterion cannot be judged before its part is over."""


class _SoFar(Observation):
    """An Observation that is not complete: a stimulus that is missing may still come."""

    def has(self, name: str) -> bool:
        if not super().has(name):
            raise Pending(name)
        return True

    def during(self, name: str, may_die: bool = False) -> Scene:
        if name not in self.missing:
            self.has(name)
        return super().during(name, may_die)


class OpenCriteria:
    """The criteria of these parts; each is judged as soon as its verdict is final."""

    def __init__(self, criteria: Iterable[Criterion], worth: Mapping[str, float],
                 parts: Sequence[str]) -> None:
        self._open = [criterion for criterion in criteria if criterion.part in parts]
        self._worth, self._marks = worth, Marks('')

    def look(self, observation: Observation) -> List[Verdict]:
        """Returns the verdicts that are final now, in the middle of a part."""
        return self._judge(_SoFar(**vars(observation)), self._open, asked=True)

    def questions(self, observation: Observation, part: str) -> List[Question]:
        """Returns the questions at the end of a part: one for each open criterion about the
        node's output, which is not fully known."""
        return [QUESTIONS[criterion.name] for criterion in self._open
                if criterion.part == part and criterion.name in QUESTIONS
                and observation.has(QUESTIONS[criterion.name].stimulus)]

    def end(self, observation: Observation, part: str) -> List[Verdict]:
        """Returns the verdicts on the open criteria of a part at its end."""
        return self._judge(observation, [c for c in self._open if c.part == part])

    def _judge(self, observation, criteria, asked=False):
        """`asked`: is a person asked before a criterion of QUESTIONS is missed?"""
        judged = []
        for criterion in list(criteria):
            try:
                verdict, = judge([criterion], observation, self._worth)
            except Pending:
                continue
            if asked and criterion.name in QUESTIONS and verdict.outcome is Outcome.MISSED:
                continue
            judged.append(verdict)
            self._open.remove(criterion)
        self._marks.verdicts += judged
        return judged

    @property
    def all_met(self) -> bool:
        """Are all of the handout's criteria judged and met?"""
        graded = self._marks.graded
        return bool(graded) and all(
            verdict.outcome is Outcome.MET for verdict in graded) and all(
            criterion.extra for criterion in self._open)

    @property
    def points(self) -> Tuple[float, float]:
        """(points that were earned, full marks); open criteria count for the full marks."""
        still_open = sum(self._worth[c.name] for c in self._open if not c.extra)
        return self._marks.points, self._marks.worth + still_open


# -- the checkoff

def parts_of(lab, given):
    """Returns the parts to try: those `given`, or all that have a criterion of the handout.

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

    def __init__(self, lab, parts, worth, name, person, goal=move2goal.GOAL):
        """`worth`: criterion -> points; `name`: that of the node, '' if any will do; `goal`:
        as for a Stage. ``Impossible`` if there is no robot, or if another program publishes a topic
        that this program must publish."""
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
    """The bag of a checkoff, for lab_report.py; `path` is None if rosbag is not installed."""

    def __init__(self, path):
        found = find_node('rosbag', 'record')
        self.path = path if found else None
        self._process = subprocess.Popen(
            [found[0], '--quiet', '-O', str(path)] + [rospy.resolve_name(t) for t in RECORDED],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            start_new_session=True) if found else None

    def close(self):
        """End the recording."""
        if self._process is None:
            return
        self._process.send_signal(signal.SIGINT)
        try:
            self._process.wait(CLOSING)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
