"""The labs that can be marked, the points of their criteria, and the marks of a submission.

An instructor may edit the table of the points, which contains a section for each lab. The section
`extra` of a lab contains the points of the criteria beyond the handout:

    turn:
      left: 3
      extra: {within_1_deg: 0}
"""
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, NamedTuple, Optional, Sequence

import rospkg
import yaml

from tb3_labs.command_line import error_text, printable
from tb3_labs.marking.labs import gamepad, imu, move2goal, turn
from tb3_labs.marking.labs.criteria import Criterion, Outcome, Verdict, verdicts_of
from tb3_labs.marking.student_nodes import GAMEPAD, IMU, MOVE2GOAL, TURN
from tb3_labs.marking.trial.observation import (
    MAX_FAIR_GAP, MAX_SENTENCE_LENGTH, NO_RECORDING, Observation)
from tb3_labs.marking.trial.remarks import (
    remarks_on, tracebacks_before_the_end, version_errors)
from tb3_labs.watch import lab_mistakes
from tb3_labs.watch.mistake import Mistake, NodeRun, find_first_mistake

MAX_POINTS = 10 ** 6        # the most points for one criterion
MAX_SENTENCES = 100         # further remarks and further findings are left out
NOT_JUDGED = 'not judged'
EXTRA_SECTION = 'extra'


class Lab(NamedTuple):
    """A lab that can be marked."""

    title: str
    criteria: List[Criterion]
    #: Returns sentences on mistakes that cost no points.
    remarks_on_trial: Callable[[Observation], List[str]] = lambda observation: []

    @property
    def parts(self) -> List[str]:
        return list(dict.fromkeys(criterion.part for criterion in self.criteria))

    def read_parts(self, text: str) -> List[str]:
        """Returns the parts in `text`, such as 'turns,mouse'. Raises ``ValueError`` if the lab does
        not have one of these parts."""
        parts = [part.strip() for part in text.split(',') if part.strip()]
        unknown = sorted(set(parts) - set(self.parts))
        if unknown:
            raise ValueError(f"{self.title} has these parts: {', '.join(self.parts)}; not: "
                             f"{', '.join(unknown)}")
        return parts


LABS = {
    IMU: Lab('IMU exercise', imu.CRITERIA),
    TURN: Lab('IMU lab', turn.CRITERIA, turn.remarks_on_turns),
    MOVE2GOAL: Lab('Transformation lab, move to goal', move2goal.CRITERIA),
    GAMEPAD: Lab('Transformation lab, gamepad', gamepad.CRITERIA)}


@dataclass
class Marks:
    """The marks of a submission. Verdicts and points are added after the trial."""

    student: str
    node: str = ''                   # package/file
    number: str = ''                 # the student's number on the learning platform
    late: bool = False               # the learning platform calls the submission late
    remarks: List[str] = field(default_factory=list)      # sentences for the student
    findings: List[str] = field(default_factory=list)     # sentences only for the instructor
    unjudged: str = ''               # why the submission was not judged, or '' if it was judged
    seconds: float = 0.0             # the duration [s] of the trial
    #: A page shows a path without these beginnings, because only the marking machine has them.
    path_prefixes: List[str] = field(default_factory=list)
    verdicts: List[Verdict] = field(default_factory=list)
    observation: Optional[Observation] = None    # None if there was no trial
    decided_points: Optional[float] = None       # None if no person gave points
    decision_reason: str = ''                    # a person's reason for the decided points
    first_mistake: Optional[Mistake] = None      # see _find_first_mistake

    @property
    def has_known_points(self) -> bool:
        """True if mark.py or a person gave points."""
        return not self.unjudged or self.decided_points is not None

    @property
    def meets_handout(self) -> bool:
        """True if the node meets all criteria of the handout."""
        return not self.unjudged and all(
            verdict.outcome is Outcome.MET for verdict in self.graded_verdicts)

    @property
    def delay_sentence(self) -> str:
        """A warning if points were lost and the machine was too busy for a fair trial, or ''."""
        gap = self.observation.longest_gap if self.observation else 0.0
        if gap <= MAX_FAIR_GAP or self.meets_handout:
            return ''
        return (f'The machine held the robot up for {gap:.2f} s (up to {MAX_FAIR_GAP:g} s are '
                'fair): the marks may be unfair.')

    @property
    def mistake_sentence(self) -> str:
        """A sentence on the first mistake, with line numbers, or '' if there is no mistake."""
        if self.first_mistake is None or self.observation is None:
            return ''
        return self.first_mistake.as_sentence(self.observation.assigned)

    @property
    def hint(self) -> str:
        """The first mistake, and the place in a lab sheet that explains this mistake, or ''."""
        if self.first_mistake is None:
            return ''
        return f'{self.mistake_sentence} See {self.first_mistake.sheet_step}.'

    @property
    def sentences(self) -> List[str]:
        """The remarks. If the submission was not judged, the reason comes first."""
        return [self.unjudged, *self.remarks] if self.unjudged else self.remarks

    @property
    def points(self) -> float:
        """The points that a person gave, or else the points from mark.py."""
        return self.earned_points if self.decided_points is None else self.decided_points

    @property
    def points_text(self) -> str:
        """The points in words, or NOT_JUDGED if neither mark.py nor a person gave points."""
        if not self.has_known_points:
            return NOT_JUDGED
        extra_points = sum(verdict.points for verdict in self.extra_verdicts)
        if extra_points and self.decided_points is None:
            return (f'{self.points:g} of {self.full_points:g} points, {extra_points:g} of them '
                    'beyond the handout')
        return f'{self.points:g} of {self.full_points:g} points'

    @property
    def earned_points(self) -> float:
        """The points from mark.py, including the points for the extra criteria."""
        return sum(verdict.points for verdict in self.verdicts)

    @property
    def full_points(self) -> float:
        """Full marks: the sum of the points for the handout's criteria."""
        return sum(verdict.full_points for verdict in self.graded_verdicts)

    @property
    def graded_verdicts(self) -> List[Verdict]:
        """The verdicts on the handout's criteria."""
        return [verdict for verdict in self.verdicts if not verdict.criterion.is_extra]

    @property
    def extra_verdicts(self) -> List[Verdict]:
        """The verdicts on criteria beyond the handout."""
        return [verdict for verdict in self.verdicts if verdict.criterion.is_extra]


def marks_after_trial(trial_marks: Marks, observation: Optional[Observation], lab: str,
                      criterion_points: Mapping[str, float], parts: Sequence[str] = ()) -> Marks:
    """Returns `trial_marks` with verdicts and points.

    `observation` is None if there was no trial. `criterion_points` is a dict {name of a criterion:
    points}. `parts` are the tried parts of the lab, or [] if all parts were tried.
    """
    marks = replace(trial_marks, observation=observation, findings=list(trial_marks.findings))
    if observation is None:
        observation = Observation(lab, marks.node)
    marks.node = marks.node or observation.node
    if observation.marker_error and not marks.unjudged:
        marks.unjudged = f'The marker itself failed ({observation.marker_error}).'
    marks.verdicts = verdicts_of(LABS[lab].criteria, observation, criterion_points, parts)

    verdict_text = ' '.join(verdict.reason for verdict in marks.verdicts)
    marks.remarks = [*marks.remarks, *remarks_on(observation, verdict_text),
                     *LABS[lab].remarks_on_trial(observation)]
    _judge_variables(marks, observation, lab)
    marks.findings += observation.findings + version_errors(observation)
    if marks.delay_sentence:
        marks.remarks.append(marks.delay_sentence)
        marks.findings.append(f'{marks.delay_sentence} Type the same command again.')
    if marks.unjudged:
        marks.findings.insert(0, 'Not judged: ' + marks.unjudged)
    marks.remarks = _printable_sentences(marks.remarks)
    marks.findings = _printable_sentences(marks.findings)
    return marks


def _judge_variables(marks, observation, lab):
    """Look for mistakes in the recorded variables of the node. If the node meets the handout, add
    remarks on these mistakes to `marks`. Otherwise set the first mistake of `marks`."""
    try:
        if marks.meets_handout:
            marks.remarks += lab_mistakes.remarks(observation.recording, lab)
        else:
            marks.first_mistake = _find_first_mistake(observation, marks.graded_verdicts)
    except Exception as error:        # a node's variables may have any value
        marks.findings.append('The marker could not look inside the node '
                              f'({type(error).__name__}: {error}).')


def _find_first_mistake(observation, verdicts):
    """Returns the first mistake in the parts of the lab in which the node lost points, or None.
    Also returns None if a remark already names an exception, an unpublished topic, or a command
    that is not finite. `verdicts` are on the handout's criteria."""
    if observation.recording is NO_RECORDING or tracebacks_before_the_end(observation):
        return None
    if observation.clause_on_silent_topics or observation.not_finite:
        return None
    parts_of_handout = {verdict.criterion.part for verdict in verdicts}
    missed_parts = {verdict.criterion.part for verdict in verdicts
                    if verdict.outcome is not Outcome.MET}
    variables = observation.recording.variables
    for part, begin, end in observation.part_intervals():
        if part not in parts_of_handout:    # the handout does not ask for what the node does here
            is_in_part = (variables.arrival >= begin) & (variables.arrival < end)
            variables = variables.take(~is_in_part)
    node_run = NodeRun(replace(observation.recording, variables=variables))
    return find_first_mistake(node_run, lab_mistakes.CHECKS.get(observation.lab, ()), missed_parts)


def _printable_sentences(sentences):
    # a sentence may quote any characters of a submission
    return [printable(text[:MAX_SENTENCE_LENGTH]) for text in sentences[:MAX_SENTENCES]]


def points_of(lab: str, table: Any) -> Dict[str, float]:
    """Returns {name of a criterion: points} from `table`, the content of a file of points. Raises
    ``ValueError`` if a name is missing or unknown, or if points are not from 0 to MAX_POINTS."""
    if not isinstance(table, dict) or not isinstance(table.get(lab), dict):
        raise ValueError(f'the points have no section "{lab}"')
    graded = dict(table[lab])
    extra = graded.pop(EXTRA_SECTION, {})
    if not isinstance(extra, dict):
        raise ValueError(f'{lab}: "{EXTRA_SECTION}" is a section of its own')
    _refuse_invalid_points(lab, graded, is_extra=False)
    _refuse_invalid_points(lab, extra, is_extra=True)
    return {**graded, **extra}


def _refuse_invalid_points(lab, section, is_extra):
    names = [criterion.name for criterion in LABS[lab].criteria if criterion.is_extra == is_extra]
    for name in [*section, *names]:
        if name not in names:
            raise ValueError(f'{lab}: no criterion is called "{name}"; these are: '
                             + ', '.join(names))
        points = section.get(name)      # None if the section lacks the criterion
        is_number = isinstance(points, (int, float)) and not isinstance(points, bool)
        if not (is_number and 0 <= points <= MAX_POINTS):
            raise ValueError(f'{lab}: {name} = {points!r} is not valid: a number from 0 '
                             f'to {MAX_POINTS}')


def read_points(path: Optional[Path]) -> Any:
    """Returns the table in a file of points. The default is points.yaml of this package. Raises
    ``ValueError`` with the reason if the file cannot be read."""
    if path is None:
        path = Path(rospkg.RosPack().get_path('tb3_labs')) / 'launch/checks/points.yaml'
    try:
        with open(str(path), encoding='utf-8') as file:
            return yaml.safe_load(file)
    except OSError as error:
        raise ValueError(f'the points, {path}, cannot be read: {error.strerror}') from None
    except (UnicodeDecodeError, yaml.YAMLError) as error:
        raise ValueError(f'the points, {path}, are not YAML: {error_text(error)}') from None
