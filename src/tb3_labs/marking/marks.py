"""The labs that can be marked, the points of their criteria, and the marks of a submission.

The points stand in a table that an instructor edits. The first level has the
names of labs, the second level the names of criteria. `extra` has the criteria beyond the handout:

    turn:
      left: 3
      extra: {within_1_deg: 0}

Marks are kept in a record: after one try a submission can be judged again with other points. The
record has the verdicts, not the observation. It has the key of the try: another try with the same
key would have the same result.
"""
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Callable, Dict, Iterable, List, Mapping, NamedTuple, Optional, Sequence

import rospkg
import yaml

from tb3_labs.command_line import reason
from tb3_labs.marking.labs import gamepad, imu, move2goal, turn, turn_hints
from tb3_labs.marking.labs.criteria import Criterion, Outcome, Verdict
from tb3_labs.marking.lab_names import GAMEPAD, IMU, MOVE2GOAL, TURN
from tb3_labs.marking.trial.observation import Observation

#: The words for marks that could not be given.
NOT_JUDGED = 'not judged'
#: The section of a lab's points for criteria beyond the handout.
EXTRA = 'extra'


class Lab(NamedTuple):
    """The requirements of a lab."""

    title: str
    criteria: List[Criterion]
    #: The mistake that a node may have, in a sentence; '' if it is not known.
    hint: Callable[[Observation], str] = lambda seen: ''
    #: A mistake to look for if nothing else explains the node.
    last_hint: Callable[[Observation], str] = lambda seen: ''

    @property
    def parts(self) -> List[str]:
        return list(dict.fromkeys(criterion.part for criterion in self.criteria))

    def checked_parts(self, text: str) -> List[str]:
        """The parts in a list with commas; ``ValueError`` for a part that the lab does not have."""
        parts = [part.strip() for part in text.split(',') if part.strip()]
        if not set(parts) <= set(self.parts):
            raise ValueError('{} has these parts: {}; not: {}'.format(
                self.title, ', '.join(self.parts), ', '.join(sorted(set(parts) - set(self.parts)))))
        return parts


LABS = {
    IMU: Lab('IMU exercise', imu.CRITERIA, imu.hint),
    TURN: Lab('IMU lab', turn.CRITERIA, turn_hints.hint, turn_hints.last_hint),
    MOVE2GOAL: Lab('Transformation lab, move to goal', move2goal.CRITERIA,
                   last_hint=move2goal.last_hint),
    GAMEPAD: Lab('Transformation lab, gamepad', gamepad.CRITERIA)}


@dataclass
class Marks:
    """One submission: its verdicts, and remarks."""

    student: str
    node: str = ''                   # package/file
    verdicts: List[Verdict] = field(default_factory=list)
    remarks: List[str] = field(default_factory=list)      # sentences
    observation: Optional[Observation] = None  # None: nothing could be observed
    findings: List[str] = field(default_factory=list)     # for the instructor alone; sentences
    unjudged: str = ''               # why it could not be judged, a sentence; '' if it was
    seconds: float = 0.0             # the time that the marking took [s]

    @property
    def judged(self) -> bool:
        """Was the submission judged? If not, its points are unknown, not 0."""
        return not self.unjudged

    @property
    def unfair(self) -> str:
        """A sentence if the machine was too busy to judge the node fairly, else ''."""
        return self.observation.unfair if self.observation else ''

    @property
    def sentences(self) -> List[str]:
        """The reason why it was not judged, and all remarks."""
        return [self.unjudged] * bool(self.unjudged) + self.remarks

    @property
    def why_none(self) -> str:
        """The reason if it was not judged, or has no points; else ''."""
        if self.unjudged or self.points:
            return self.unjudged
        return next((verdict.seen for verdict in self.graded if verdict.seen), '')

    @property
    def points(self) -> float:
        """The points that were earned, those of extra criteria included."""
        return sum(verdict.points for verdict in self.verdicts)

    @property
    def worth(self) -> float:
        """The points of all criteria of the handout together: full marks."""
        return sum(verdict.worth for verdict in self.graded)

    @property
    def graded(self) -> List[Verdict]:
        """The verdicts on the handout's criteria."""
        return [verdict for verdict in self.verdicts if not verdict.criterion.extra]

    @property
    def extra(self) -> List[Verdict]:
        """The verdicts on criteria beyond the handout."""
        return [verdict for verdict in self.verdicts if verdict.criterion.extra]


# -- points

def points_of(lab: str, table: Any) -> Dict[str, float]:
    """Returns name of a criterion -> its points; `table`: from yaml.safe_load().

    ``ValueError`` if it has no section for the lab, if it lacks a criterion or has an unknown
    one, or if points are not finite, or below 0.
    """
    criteria = LABS[lab].criteria
    if not isinstance(table, dict) or not isinstance(table.get(lab), dict):
        raise ValueError('the points have no section "{}"'.format(lab))
    given = dict(table[lab])
    extra = given.pop(EXTRA, {})
    if not isinstance(extra, dict):
        raise ValueError('{}: "{}" is a section of its own'.format(lab, EXTRA))
    worth: Dict[str, float] = {}
    for section, names in ((given, [c.name for c in criteria if not c.extra]),
                           (extra, [c.name for c in criteria if c.extra])):
        for name in section:
            if name not in names:
                raise ValueError('{}: no criterion is called "{}"; these are: {}'.format(
                    lab, name, ', '.join(names)))
        for name in names:
            points = section.get(name)
            if isinstance(points, bool) or not isinstance(points, (int, float)) or not (
                    math.isfinite(points) and points >= 0):
                raise ValueError('{}: {} = {!r} is not valid: a number of at least 0'.format(
                    lab, name, points))
            worth[name] = points
    return worth


def read_points(path: Optional[Path]) -> Any:
    """Returns the table in a file of points; this package's file if `path` is None.

    ``ValueError`` with the reason if it cannot be read.
    """
    path = path or (
        Path(rospkg.RosPack().get_path('tb3_labs')) / 'launch' / 'checks' / 'points.yaml')
    try:
        with open(str(path), encoding='utf-8') as file:
            return yaml.safe_load(file)
    except OSError as problem:
        raise ValueError('the points, {}, cannot be read: {}'.format(
            path, problem.strerror)) from None
    except (UnicodeDecodeError, yaml.YAMLError) as problem:
        raise ValueError('the points, {}, are not YAML: {}'.format(
            path, reason(problem))) from None


# -- records

def to_record(marks: Marks, key: Mapping[str, Any]) -> Dict[str, Any]:
    """Returns the record of these marks."""
    return {'key': dict(key),
            'marks': {name: value for name, value in vars(marks).items()
                      if name not in ('verdicts', 'observation')},
            'verdicts': {verdict.criterion.name: [verdict.outcome.value, verdict.seen]
                         for verdict in marks.verdicts},
            'page': [verdict.worth for verdict in marks.verdicts]}


def from_record(record: Mapping[str, Any], criteria: Iterable[Criterion],
                worth: Mapping[str, float], parts: Sequence[str] = ()) -> Marks:
    """Returns the Marks of a record, with the points `worth` for each criterion.

    ``ValueError`` if the record lacks a criterion of these parts, or is of another version.
    """
    try:
        marks = Marks(**record['marks'])
        for criterion in criteria:
            if criterion.is_tried(parts):
                outcome, seen = record['verdicts'][criterion.name]
                marks.verdicts.append(Verdict(criterion, Outcome(outcome), seen,
                                              worth[criterion.name]))
    except (KeyError, TypeError) as problem:
        raise ValueError('the record lacks {}'.format(problem)) from None
    return marks
