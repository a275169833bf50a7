"""A criterion, the verdict on a node by a criterion, and the criteria that several labs share.

The function `judge` of a criterion gets an Observation, and returns a Reason. Students read the
Reason with the `meaning` of the criterion (the requirement) and with `where` (a place in a lab
sheet). None of the three texts contains the solution.
"""
from dataclasses import dataclass
from enum import Enum
from typing import Callable, Iterable, List, Mapping, Optional, Sequence, Set, Tuple

import numpy as np

from tb3_labs.marking.trial.observation import (
    CTRL_C, WAS_MOVING, NotObserved, NotOffered, NotTried, Observation, Scene)
from tb3_labs.marking.trial.remarks import (
    NOT_THEIRS, STOPPED_BY, exceptions_in, other_fields, reason_of, why_idle, why_missing)
from tb3_labs.watch.chains import IMU_SHEET, TRANSFORMATION_SHEET, Place


#: A clause on the node's behaviour, by which a criterion is not met; '' if the criterion is met.
Reason = str
#: The Reason of a second criterion that could not be tried for the same reason.
NOT_TRIED = 'this could not be tried'


class Outcome(Enum):
    """The result of a node for one criterion."""

    MET = 'met'
    MISSED = 'not met'
    NOT_OFFERED = 'not offered'


#: The places to which the criteria of several labs point.
IMU_EXTRAS = Place(IMU_SHEET, 'Beyond the handout')
BEYOND = Place(TRANSFORMATION_SHEET, 'Beyond the handout')


@dataclass(frozen=True)
class Criterion:
    """One thing that a node should do."""

    name: str
    part: str                # the part of the lab that tries it
    meaning: str             # the requirement
    where: Place             # the place that explains it
    judge: Callable[[Observation], Reason]
    extra: bool = False      # is it beyond the handout?
    limits: str = ''         # the numbers that `meaning` does not have
    also: str = ''           # another part that it needs

    def is_tried(self, parts: Sequence[str]) -> bool:
        """Is it judged if these parts are tried? An empty list means all parts."""
        return not parts or {self.part, self.also or self.part} <= set(parts)

    @property
    def label(self) -> str:
        """The name, which begins with 'extra_' for a criterion beyond the handout."""
        return 'extra_' + self.name if self.extra else self.name


@dataclass(frozen=True)
class Verdict:
    """The judgement of one criterion."""

    criterion: Criterion
    outcome: Outcome
    observed: str            # '' if it is met
    worth: float             # points for a criterion that is met
    moment: Optional[float] = None      # the start of the stimulus that was judged [s]

    @property
    def points(self) -> float:
        """The earned points: `worth` or 0."""
        return self.worth if self.outcome is Outcome.MET else 0.0

    @property
    def sentence(self) -> str:
        """The observation and its place in the sheet; '' if the criterion is met."""
        if self.outcome is Outcome.MET or self.observed == NOT_TRIED:
            return self.observed
        return f'{self.observed}; see {self.criterion.where}'

    @property
    def line(self) -> str:
        """The verdict in one line: outcome, points, requirement, sentence."""
        points = 'extra' if self.criterion.extra and not self.worth else \
            f'{self.points:g} of {self.worth:g}'
        words = ': '.join(filter(None, [self.criterion.meaning, self.sentence]))
        outcome = self.outcome.value.upper()    # capitals are found among many lines
        if self.outcome is Outcome.MET or self.criterion.extra:
            outcome = 'not yet' if self.outcome is Outcome.MISSED else self.outcome.value
        return f'  {outcome:11}  {points:8}  {words}'


def judge(criteria: Iterable[Criterion], observation: Observation, worth: Mapping[str, float],
          parts: Sequence[str] = ()) -> List[Verdict]:
    """Returns a Verdict for each criterion of these parts, [] for all parts. `worth` maps the name
    of a criterion to its points."""
    verdicts: List[Verdict] = []
    quoted: Set[str] = set()
    for criterion in criteria:
        if not criterion.is_tried(parts):
            continue
        observation.moment = None
        try:
            clause = _quoted_once(criterion.judge(observation), quoted)
            outcome = Outcome.MISSED if clause else Outcome.MET
        except NotObserved as reason:
            outcome = Outcome.NOT_OFFERED if isinstance(reason, NotOffered) else Outcome.MISSED
            clause = _quoted_once(reason_of(reason, observation), quoted)
            if isinstance(reason, NotTried) and any(clause == each.observed for each in verdicts):
                clause = NOT_TRIED    # a node that fails at its start gets its reason once
        verdicts.append(Verdict(criterion, outcome, clause, worth[criterion.name],
                                observation.moment))
    return verdicts


def _quoted_once(clause: Reason, quoted: Set[str]) -> Reason:
    """Returns the clause, without its exception if the set `quoted` has it; adds it otherwise."""
    words, stopped, error = clause.partition(STOPPED_BY + ', ')
    if not stopped or error not in quoted:
        quoted.add(error)
        return clause
    return words + 'the same exception had stopped it'


# ----- criteria of several labs: start and Ctrl+C -----

#: Keys of the facts of a Ctrl+C. TOOK: the time until the node had ended [s], None if the node had
#: to be killed. SIGNAL: the number of the signal that ended the node, 0 if it ended by itself.
TOOK, SIGNAL = 'took', 'signal'
#: A node must run, and listen to its topic, within this time [s].
START_TIME = 15.0
#: A node must end within this time after Ctrl+C [s]; rospy itself needs up to 2 s.
ENDING = 5.0
#: A stop "at once", such as the zero velocity at Ctrl+C, must come within this time [s].
AT_ONCE = 0.5
#: A node must stop the robot within this time after a sensor or an input fell silent [s].
LOST_AFTER = 1.0
#: A limit [s] in words.
within = 'within {:g} s'.format
IN_TIME, STOPS_AT_ONCE = within(START_TIME), within(AT_ONCE)


def starts(observed: Observation) -> Reason:
    """Judges whether the node ran, and subscribed to the robot's topic."""
    return why_missing(observed) if not observed.runs or observed.runs[0].ready is None else ''


def ends_cleanly(part: str, where: Place) -> Criterion:
    """Returns the criterion that the node ends by itself at Ctrl+C, without a traceback."""
    return Criterion(
        'clean_exit', part, 'at Ctrl+C ends by itself, without a traceback', where,
        lambda observed: next(filter(None, map(_clean_exit, observed.scenes(CTRL_C, True))), ''),
        limits=f'{within(ENDING)}; "{NOT_THEIRS}", which rospy raises, does not count')


def _clean_exit(scene: Scene) -> Reason:
    if scene.facts[TOOK] is None:
        return f'it was still running {ENDING:g} s after Ctrl+C and had to be killed'
    errors = exceptions_in(scene)
    if errors:
        return 'it ended with a traceback' + (errors[-1] and f': {errors[-1]!r}')
    if scene.facts[SIGNAL] not in (0, 2, 15):       # by itself, by SIGINT, by SIGTERM
        return f'it was ended by signal {scene.facts[SIGNAL]}'
    return ''


def stops_robot(observed: Observation) -> Reason:
    """Judges whether the node sent a zero velocity at one Ctrl+C or more."""
    scenes = [scene for scene in observed.scenes(CTRL_C, may_die=True) if scene.facts[WAS_MOVING]]
    if not scenes:
        return 'it did not move the robot before Ctrl+C, so that a stop could not be seen'
    for scene in scenes:
        soon, _ = scene.split(AT_ONCE)
        if (soon[:, 1:] == 0.0).all(axis=1).any():
            return ''
    observed.scene(scenes[-1].name, may_die=True)
    return 'at Ctrl+C in the middle of a movement it sent no zero velocity: the robot went on'


def prints(observed: Observation, words: str) -> Reason:
    """Judges whether the node printed these words at Ctrl+C."""
    scene = observed.scene(CTRL_C[0], may_die=True)
    return '' if words in scene.printed else f'"{words}" was not printed at Ctrl+C'


# ----- criteria of several labs: stopping the robot -----

#: The part in which a sensor or an input falls silent.
LOST = 'lost'
#: A robot stops by itself half a second after its last command. That is not a stop by its node.
NO_ZERO = 'it sent no zero velocity after {}: the robot went on until its own timeout'


def not_stopped(scene: Scene, event: str, limit: float = AT_ONCE) -> Reason:
    """Judges whether the node stopped the robot by a zero velocity within `limit` [s] after the
    begin of the scene, which is the `event`."""
    soon, late = scene.split(limit)
    if late[:, 1:].any():
        return f'the robot was still driven {limit:g} s after {event}'
    return '' if len(soon) and not soon[-1, 1:].any() else NO_ZERO.format(event)


def stops_when_lost(name: str, meaning: str, what: str, stimulus: str, where: Place) -> Criterion:
    """Returns the criterion beyond the handout that the node stops the robot after `what` fell
    silent."""
    def judge_stop(observed: Observation) -> Reason:
        scene = observed.scene(stimulus)
        return not_stopped(scene, what + ' fell silent', LOST_AFTER) if scene.facts[
            WAS_MOVING] else f'the robot was not moving when {what} fell silent'
    return Criterion(name, LOST, f'{meaning} after {what} fell silent', where, judge_stop,
                     extra=True, limits=within(LOST_AFTER))


# ----- criteria of several labs: driving by a stick or a mouse -----

#: The least and the greatest value of a command.
Bounds = Tuple[float, float]
#: The columns of a command.
LINEAR, ANGULAR = 1, 2
#: The other speed, linear or angular, must be smaller than this [m/s] or [rad/s].
NEAR = 0.05
NOTHING, ANY = (-NEAR, NEAR), (-np.inf, np.inf)
#: Rounding may exceed a limit by this [m/s] or [rad/s].
ROUNDING = 0.005


def steers(observed: Observation, name: str, linear: Bounds = NOTHING, angular: Bounds = NOTHING,
           of_moving: bool = False) -> Reason:
    """Judges whether the last command of the stimulus `name` is within the closed bounds [m/s] and
    [rad/s]; if `of_moving`, the last command that is not zero."""
    scene = observed.scene(name)
    commands = scene.moving if of_moving else scene.commands
    if not len(commands) or not commands[-1, 1:].any():
        return 'with the {} {} commanded: {}'.format(
            name, 'neither linear.x nor angular.z was' if other_fields(scene) else 'nothing was',
            why_idle(scene))
    if all(low <= speed <= high for speed, (low, high) in zip(
            commands[-1, 1:], (linear, angular))):
        return ''
    asked = [form.format(*bounds) for bounds, form in (
        (linear, '{:.2f} to {:.2f} m/s'), (angular, '{:.2f} to {:.2f} rad/s'))
        if bounds not in (NOTHING, ANY)]
    if NOTHING in (linear, angular):
        asked.append('nothing else')
    linear_speed, angular_speed = commands[-1, 1:]
    return 'with the {} it commanded {:.2f} m/s and {:.2f} rad/s, where {} were asked for'.format(
        name, linear_speed, angular_speed, ' and '.join(asked))


def times(factor: float, bounds: Bounds) -> Bounds:
    """Returns the bounds times `factor`; a negative factor mirrors them."""
    return min(factor * bounds[0], factor * bounds[1]), max(factor * bounds[0], factor * bounds[1])
