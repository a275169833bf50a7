"""Defines criteria, verdicts, and the criteria that several labs share.

Students read the `meaning` and the `sheet_step` of a criterion, and the Reason that the function
`judge` returns. No text that students read contains the solution.
"""
from dataclasses import dataclass
from enum import Enum
from typing import Callable, Iterable, List, Mapping, Optional, Sequence, Tuple

import numpy as np

from tb3_labs.marking.labs import stimuli
from tb3_labs.marking.trial.observation import (
    CTRL_C, LINEAR, WAS_MOVING, NotObserved, NotOffered, NotTried, Observation)
from tb3_labs.marking.trial.remarks import (
    CLOSED_TOPIC, clause_on_other_fields, exceptions_in, why_idle, why_not_judged, why_not_tried)
from tb3_labs.watch.lab_mistakes import IMU_SHEET, TRANSFORMATION_SHEET
from tb3_labs.watch.mistake import SheetStep

#: A clause that says why a node does not meet a criterion; '' if the node meets it. The functions
#: judge_... return a Reason. The expression `a or b` gives the first Reason that is not ''.
Reason = str
#: The Reason of a criterion that was not tried, if an earlier verdict already says why.
NOT_TRIED = 'this could not be tried'


class Outcome(Enum):
    """The result of a node for one criterion."""

    MET = 'met'
    MISSED = 'not met'
    NOT_OFFERED = 'not offered'


IMU_EXTRAS = SheetStep(IMU_SHEET, 'Beyond the handout')
EXTRAS = SheetStep(TRANSFORMATION_SHEET, 'Beyond the handout')


@dataclass(frozen=True)
class Criterion:
    """A requirement on a node, and the function that judges the node."""

    name: str
    part: str                # the part of the lab
    meaning: str             # the requirement
    sheet_step: SheetStep    # the place in a lab sheet that explains the requirement
    judge: Callable[[Observation], Reason]
    is_extra: bool = False   # the criterion is beyond the handout
    limits: str = ''         # a text with the limits that `meaning` does not name

    @property
    def label(self) -> str:
        """The name, with 'extra_' before the name of a criterion beyond the handout."""
        return 'extra_' + self.name if self.is_extra else self.name


@dataclass(frozen=True)
class Verdict:
    """The judgement of one criterion."""

    criterion: Criterion
    outcome: Outcome
    reason: Reason
    full_points: float                # the points of a met criterion
    moment: Optional[float] = None    # the time [s] at which the judged stimulus began

    @property
    def points(self) -> float:
        return self.full_points if self.outcome is Outcome.MET else 0.0

    @property
    def sentence(self) -> str:
        """The Reason, and usually the place in the sheet; '' if the criterion is met."""
        if self.outcome is Outcome.MET or self.reason == NOT_TRIED:
            return self.reason
        return f'{self.reason}; see {self.criterion.sheet_step}'

    @property
    def line(self) -> str:
        """A line with the outcome, the points, the requirement and the property `sentence`."""
        is_unscored = self.criterion.is_extra and not self.full_points
        points = 'extra' if is_unscored else f'{self.points:g} of {self.full_points:g}'
        text = ': '.join(filter(None, [self.criterion.meaning, self.sentence]))
        return f'  {self._printed_outcome:11}  {points:8}  {text}'

    @property
    def _printed_outcome(self) -> str:
        if self.criterion.is_extra and self.outcome is Outcome.MISSED:
            return 'not yet'
        if self.criterion.is_extra or self.outcome is Outcome.MET:
            return self.outcome.value
        return self.outcome.value.upper()    # capitals are easy to find among many lines


def verdicts_of(criteria: Iterable[Criterion], observation: Observation,
                points_by_criterion: Mapping[str, float], parts: Sequence[str] = ()
                ) -> List[Verdict]:
    """Returns the Verdicts on the criteria of the `parts`, or of all parts if `parts` is empty."""
    verdicts: List[Verdict] = []
    for criterion in criteria:
        if parts and criterion.part not in parts:
            continue
        observation.moment = None
        try:
            reason = criterion.judge(observation)
            outcome = Outcome.MISSED if reason else Outcome.MET
        except NotObserved as error:
            reason = why_not_judged(error, observation)
            outcome = Outcome.NOT_OFFERED if isinstance(error, NotOffered) else Outcome.MISSED
            if isinstance(error, NotTried) and reason in [verdict.reason for verdict in verdicts]:
                reason = NOT_TRIED
        verdicts.append(Verdict(criterion, outcome, reason, points_by_criterion[criterion.name],
                                observation.moment))
    return verdicts


# ----- criteria of several labs: start and Ctrl+C -----

def within(seconds: float) -> str:
    return f'within {seconds:g} s'


START_LIMITS = within(stimuli.START_TIME)
STOP_LIMITS = within(stimuli.STOP_TIME)


def judge_start(observation: Observation) -> Reason:
    """Judges whether the node's first process subscribed to the robot's topic."""
    if observation.processes and observation.processes[0].ready is not None:
        return ''
    return why_not_tried(observation)


def clean_exit_criterion(part: str, sheet_step: SheetStep) -> Criterion:
    """Returns the criterion that a node ends by itself at Ctrl+C and prints no traceback."""
    return Criterion(
        'clean_exit', part, 'at Ctrl+C ends by itself, without a traceback', sheet_step,
        _judge_exit,
        limits=f'{within(stimuli.EXIT_TIME)}; "{CLOSED_TOPIC}", which rospy raises, does not count')


def _judge_exit(observation: Observation) -> Reason:
    for scene in observation.enter_scenes(CTRL_C, may_die=True):
        if scene.facts[stimuli.EXIT_SECONDS] is None:
            return f'it was still running {stimuli.EXIT_TIME:g} s after Ctrl+C and had to be killed'
        exceptions = exceptions_in(scene)
        if exceptions:
            return f'it ended with a traceback: {exceptions[-1]!r}'
        if scene.facts[stimuli.EXIT_SIGNAL] not in (0, 2, 15):      # no signal, SIGINT, SIGTERM
            return f'it was ended by signal {scene.facts[stimuli.EXIT_SIGNAL]}'
    return ''


def judge_stop_at_ctrl_c(observation: Observation) -> Reason:
    """Judges whether the node sent a zero velocity after at least one Ctrl+C."""
    scenes = [scene for scene in observation.enter_scenes(CTRL_C, may_die=True)
              if scene.facts[WAS_MOVING]]
    if not scenes:
        return 'it did not move the robot before Ctrl+C, so that a stop could not be seen'
    for scene in scenes:
        soon, _ = scene.commands_before_and_after(stimuli.STOP_TIME)
        is_zero = (soon[:, LINEAR:] == 0.0).all(axis=1)
        if is_zero.any():
            return ''
    observation.moment = scenes[-1].begin
    return 'at Ctrl+C in the middle of a movement it sent no zero velocity: the robot went on'


def judge_line_at_ctrl_c(observation: Observation, text: str) -> Reason:
    """Judges whether the node printed `text` at Ctrl+C."""
    scene = observation.enter_scene(CTRL_C[0], may_die=True)
    return '' if text in scene.printed else f'"{text}" was not printed at Ctrl+C'


# ----- criteria of several labs: stopping the robot -----

#: Without a zero velocity the robot stops late, because its firmware waits 0.5 s for a command.
NO_ZERO_VELOCITY = 'it sent no zero velocity after {}: the robot went on until its own timeout'


def ends_in_motion(commands: np.ndarray) -> bool:
    """Returns True if there is a command, and the last command moves the robot."""
    return len(commands) > 0 and bool(commands[-1, LINEAR:].any())


def judge_stop(observation: Observation, name: str, cause: str,
               limit: float = stimuli.STOP_TIME) -> Reason:
    """Judges whether the node stopped the robot by a zero velocity within `limit` [s] after the
    start of the stimulus `name`. The `cause` is a clause that says why the robot should stop."""
    soon, later = observation.enter_scene(name).commands_before_and_after(limit)
    if later[:, LINEAR:].any():
        return f'the robot was still driven {limit:g} s after {cause}'
    if len(soon) and not ends_in_motion(soon):
        return ''
    return NO_ZERO_VELOCITY.format(cause)


def lost_device_criterion(name: str, meaning: str, device: str, stimulus: str,
                          sheet_step: SheetStep) -> Criterion:
    """Returns the extra criterion that the robot stops if a `device` sends no more messages."""
    def judge_stop_when_lost(observation: Observation) -> Reason:
        if not observation.enter_scene(stimulus).facts[WAS_MOVING]:
            return f'the robot was not moving when {device} fell silent'
        return judge_stop(
            observation, stimulus, device + ' fell silent', stimuli.LOST_STOP_TIME)
    return Criterion(name, stimuli.DEVICE_LOST, f'{meaning} after {device} fell silent', sheet_step,
                     judge_stop_when_lost, is_extra=True,
                     limits=within(stimuli.LOST_STOP_TIME))


# ----- criteria of several labs: driving by a stick or a mouse -----

Bounds = Tuple[float, float]    # the least and the greatest value of a command
ZERO_TOLERANCE = 0.05           # A speed up to this value [m/s or rad/s] counts as zero.
ZERO_BOUNDS = (-ZERO_TOLERANCE, ZERO_TOLERANCE)
ANY_BOUNDS = (-np.inf, np.inf)
#: A command may exceed a limit by this value [m/s or rad/s], because nodes round their numbers.
ROUNDING_TOLERANCE = 0.005


def judge_steering(observation: Observation, name: str, linear: Bounds = ZERO_BOUNDS,
                   angular: Bounds = ZERO_BOUNDS, skip_zeros: bool = False) -> Reason:
    """Judges whether the last command of the stimulus `name` is within the closed bounds `linear`
    [m/s] and `angular` [rad/s]. If `skip_zeros` is True, zero commands are left out."""
    scene = observation.enter_scene(name)
    commands = scene.moving_commands if skip_zeros else scene.commands
    if not ends_in_motion(commands):
        subject = ('neither linear.x nor angular.z was' if clause_on_other_fields(scene)
                   else 'nothing was')
        return f'with the {name} {subject} commanded: {why_idle(scene)}'
    speeds = commands[-1, LINEAR:]
    if all(low <= speed <= high for speed, (low, high) in zip(speeds, (linear, angular))):
        return ''
    commanded = '{:.2f} m/s and {:.2f} rad/s'.format(*speeds)
    demands = ' and '.join(_demands(linear, angular))
    return f'with the {name} it commanded {commanded}, where {demands} were asked for'


def _demands(linear, angular):
    demands = [f'{bounds_text(bounds)} {unit}'
               for bounds, unit in ((linear, 'm/s'), (angular, 'rad/s'))
               if bounds not in (ZERO_BOUNDS, ANY_BOUNDS)]
    if ZERO_BOUNDS in (linear, angular):
        demands.append('nothing else')
    return demands


def bounds_text(bounds: Bounds) -> str:
    return '{:.2f} to {:.2f}'.format(*bounds)


def scaled(bounds: Bounds, factor: float) -> Bounds:
    """Returns the Bounds times `factor`. A negative factor mirrors the Bounds at zero."""
    low, high = sorted((factor * bounds[0], factor * bounds[1]))
    return low, high
