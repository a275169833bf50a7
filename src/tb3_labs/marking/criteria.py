"""The criteria of a lab, and the verdict on a node for each.

The function `judge` of a criterion looks at an Observation. It returns '' if the criterion is met,
else one clause that says what was seen. Students read this clause together with `meaning` (what was
asked) and `where` (a place in a lab sheet). None of the three tells the solution.
"""
from dataclasses import dataclass
from enum import Enum
from typing import Callable, Iterable, List, Mapping, Sequence

from tb3_labs.marking.observation import NotOffered, NotSeen, Observation


class Outcome(Enum):
    """How a node did by one criterion."""

    MET = 'met'
    MISSED = 'not met'
    NOT_OFFERED = 'not offered'


#: How a line begins, so that what is missed is seen among many lines.
SHOUTED = {Outcome.MET: 'met', Outcome.MISSED: 'NOT MET', Outcome.NOT_OFFERED: 'NOT OFFERED'}


@dataclass(frozen=True)
class Place:
    """A place in a lab sheet: a heading, and a numbered step below it (0: no step)."""

    sheet: str
    heading: str
    step: int = 0

    def __str__(self) -> str:
        return 'doc/{}, "{}"{}'.format(
            self.sheet, self.heading, ', step {}'.format(self.step) if self.step else '')


@dataclass(frozen=True)
class Criterion:
    """One thing that a node should do."""

    name: str
    part: str                # part of the lab in which it is tried
    meaning: str             # what is asked
    where: Place             # where to look
    judge: Callable[[Observation], str]
    extra: bool = False      # beyond what the handout asks for
    limits: str = ''         # the numbers by which it is judged; '' if `meaning` has them all

    @property
    def label(self) -> str:
        """The name, which begins with 'extra_' for a criterion beyond the handout."""
        return 'extra_' + self.name if self.extra else self.name


@dataclass(frozen=True)
class Verdict:
    """The judgement of one criterion."""

    criterion: Criterion
    outcome: Outcome
    seen: str                # '' if it is met
    worth: float             # points for a criterion that is met

    @property
    def points(self) -> float:
        """The points that were earned: all of them or none."""
        return self.worth if self.outcome is Outcome.MET else 0.0

    @property
    def sentence(self) -> str:
        """What was seen and where to look; '' if the criterion is met."""
        if self.outcome is Outcome.MET:
            return ''
        return '{}; see {}'.format(self.seen, self.criterion.where)

    @property
    def line(self) -> str:
        """The verdict in one line: outcome, points, what is asked, and the sentence."""
        points = 'extra' if self.criterion.extra and not self.worth else '{:g} of {:g}'.format(
            self.points, self.worth)
        words = ': '.join(filter(None, [self.criterion.meaning, self.sentence]))
        return '  {:11}  {:8}  {}'.format(SHOUTED[self.outcome], points, words)


def judge(criteria: Iterable[Criterion], observation: Observation, worth: Mapping[str, float],
          parts: Sequence[str] = ()) -> List[Verdict]:
    """One Verdict for each criterion of these parts, of all parts if there are none given.

    `worth` has the points of each criterion by its name.
    """
    verdicts = []
    for criterion in criteria:
        if parts and criterion.part not in parts:
            continue
        try:
            seen = criterion.judge(observation)
            outcome = Outcome.MISSED if seen else Outcome.MET
        except NotOffered as reason:
            outcome, seen = Outcome.NOT_OFFERED, str(reason)
        except NotSeen as reason:
            outcome, seen = Outcome.MISSED, str(reason)
        verdicts.append(Verdict(criterion, outcome, seen, worth[criterion.name]))
    return verdicts


def first_missed(*missed: str) -> str:
    """The first of several judgements that is not ''; '' if all are met."""
    return next((said for said in missed if said), '')
