"""What a lab asks for, and whether a node does it.

A criterion's `judge` looks at an Observation and returns '' where it is met, else one sentence of
what was seen. The sentence and `where` (a place in a lab sheet) are what a student gets to read:
they never tell the solution.
"""
from dataclasses import dataclass
from enum import Enum
from typing import Callable

from tb3_labs.marking.observation import NotOffered, NotSeen


class Outcome(Enum):
    """How a node did by one criterion."""

    MET = 'met'
    MISSED = 'not met'
    NOT_OFFERED = 'not offered'


@dataclass(frozen=True)
class Place:
    """A place in a lab sheet: a heading, and a numbered step below it where there is one."""

    sheet: str
    heading: str
    step: int = 0

    def __str__(self):
        return 'doc/{}, "{}"{}'.format(
            self.sheet, self.heading, ', step {}'.format(self.step) if self.step else '')


@dataclass(frozen=True)
class Criterion:
    """One thing that a node should do."""

    name: str
    part: str                # of the lab, in which it is tried
    meaning: str
    where: Place
    judge: Callable
    extra: bool = False      # beyond what the handout asks for


@dataclass(frozen=True)
class Verdict:
    """What became of a criterion; `points` of `worth`."""

    criterion: Criterion
    outcome: Outcome
    seen: str
    worth: float

    @property
    def points(self):
        """What it earns."""
        return self.worth if self.outcome is Outcome.MET else 0.0

    @property
    def sentence(self):
        """What was seen and where to look; '' where it is met."""
        if self.outcome is Outcome.MET:
            return ''
        return '{}; see {}'.format(self.seen, self.criterion.where)


def judge(criteria, observation, worth, parts=()):
    """A Verdict for each criterion of these parts, or of all; `worth`: name -> points."""
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
