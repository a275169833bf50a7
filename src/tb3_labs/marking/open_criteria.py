"""The criteria of a checkoff; each one is judged as soon as its verdict is final."""
from typing import Iterable, List, Mapping, NamedTuple, Sequence, Tuple

from tb3_labs.marking import gamepad, move2goal
from tb3_labs.marking.criteria import Criterion, Outcome, Verdict, judge
from tb3_labs.marking.marks import Marks
from tb3_labs.marking.observation import Observation, Scene


class Question(NamedTuple):
    """A question to a person about a stimulus; a yes means that the node printed `text`."""

    stimulus: str
    words: str
    text: str


#: Name of a criterion about the node's output -> Question; only a person sees the output.
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
        """The verdicts that are final now, in the middle of a part."""
        return self._judge(_SoFar(**vars(observation)), self._open, asked=True)

    def questions(self, observation: Observation, part: str) -> List[Question]:
        """Those at the end of a part, on open criteria about the node's output."""
        return [QUESTIONS[criterion.name] for criterion in self._open
                if criterion.part == part and criterion.name in QUESTIONS
                and observation.has(QUESTIONS[criterion.name].stimulus)]

    def end(self, observation: Observation, part: str) -> List[Verdict]:
        """The verdicts on the open criteria of a part at its end."""
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
        return (bool(graded) and all(verdict.outcome is Outcome.MET for verdict in graded)
                and all(criterion.extra for criterion in self._open))

    @property
    def points(self) -> Tuple[float, float]:
        """(points that were earned, full marks); open criteria count for the full marks."""
        still_open = sum(self._worth[c.name] for c in self._open if not c.extra)
        return self._marks.points, self._marks.worth + still_open
