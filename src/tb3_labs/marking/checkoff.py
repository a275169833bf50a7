"""The checkoff at the bench: criteria are judged while a person works with the node that runs.

Headings are those of the IMU in [deg], 0 to 360.
"""
from typing import Iterable, List, Mapping, NamedTuple, Optional, Sequence, Set, Tuple

from tb3_labs.marking import gamepad, move2goal
from tb3_labs.marking.criteria import Criterion, Outcome, Verdict, judge
from tb3_labs.marking.marks import Marks
from tb3_labs.marking.observation import Observation, Scene
from tb3_labs.marking.turn import LEFT, RIGHT

#: A turn across the jump of the heading begins at least so far beyond the quadrant's begin, so that
#: the heading has jumped well before the end of the turn [deg].
MARGIN = 20.0
#: The turns of the IMU lab by the quadrant where they begin; those across a jump need the margin.
BY_QUADRANT: Sequence[Mapping[str, str]] = (
    {LEFT: LEFT, RIGHT: 'r across 0'}, {LEFT: 'l across 180', RIGHT: RIGHT},
    {LEFT: LEFT, RIGHT: 'r across 180'}, {RIGHT: RIGHT})


class Question(NamedTuple):
    """A question to a person about a stimulus, and the text that a yes stands for."""

    stimulus: str
    words: str
    text: str


#: A person alone sees what a node prints. Name of the criterion that is judged by it -> Question.
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
    """An Observation to which more may be added: a stimulus that is missing may come."""

    def has(self, name: str) -> bool:
        if not super().has(name):
            raise Pending(name)
        return True

    def during(self, name: str, may_die: bool = False) -> Scene:
        if name not in self.missing:
            self.has(name)
        return super().during(name, may_die)


class OpenCriteria:
    """The criteria of these parts; each is judged as soon as its verdict cannot change any more."""

    def __init__(self, criteria: Iterable[Criterion], worth: Mapping[str, float],
                 parts: Sequence[str]) -> None:
        self._open = [criterion for criterion in criteria if criterion.part in parts]
        self._worth, self._marks = worth, Marks('')

    def look(self, observation: Observation) -> List[Verdict]:
        """The verdicts that are certain now, in the middle of a part."""
        return self._judge(_SoFar(**vars(observation)), self._open, asked=True)

    def questions(self, observation: Observation, part: str) -> List[Question]:
        """The questions before a part ends, one for each open criterion about the print of the
        node, which is not fully known."""
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
        """Was each of the handout's criteria judged, and is it met?"""
        graded = self._marks.graded
        return bool(graded) and all(
            verdict.outcome is Outcome.MET for verdict in graded) and all(
            criterion.extra for criterion in self._open)

    @property
    def points(self) -> Tuple[float, float]:
        """(points that were earned, full marks); the points of open criteria count."""
        still_open = sum(self._worth[c.name] for c in self._open if not c.extra)
        return self._marks.points, self._marks.worth + still_open


class Next(NamedTuple):
    """The next turn to ask for: the letter to type, and its stimulus; '' if it only leads to the
    begin of the next one."""

    typed: str
    name: str


def next_turn(heading_deg: float, left: Iterable[str], margin: float = MARGIN,
              last: Optional[Next] = None) -> Optional[Next]:
    """The next of the turns `left` (names of stimuli): one that begins here, else a turn to where
    one begins. None if there is none left.

    `last`: the turn before; one that only led somewhere is not taken back, so that a robot whose
    turns are coarse does not go to and fro.
    """
    wanted = set(left)
    if not wanted:
        return None
    begins = _begins(heading_deg, wanted, margin)
    if begins is not None:
        return begins
    if last is not None and not last.name:
        return last
    leads_right = _begins(heading_deg + 90.0, wanted, margin) is None and (
        _begins(heading_deg - 90.0, wanted, margin) is not None)
    return Next(RIGHT if leads_right else LEFT, '')


def _begins(heading_deg: float, wanted: Set[str], margin: float) -> Optional[Next]:
    """A wanted turn that begins at this heading; None if there is none."""
    quadrant, beyond = divmod(heading_deg % 360.0, 90.0)
    for typed, room in ((RIGHT, 90.0 - beyond), (LEFT, beyond)):
        name = BY_QUADRANT[int(quadrant) % 4].get(typed)
        if name in wanted and (name == typed or room >= margin):
            return Next(typed, name)
    return None
