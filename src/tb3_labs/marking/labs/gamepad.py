"""The criteria of the gamepad node in the Transformation lab. The node drives the robot, hands the
robot over, and resets the local frame."""
from functools import partial
from pathlib import Path
from typing import Dict

import rospkg
import yaml

from tb3_labs.handout import (
    CTRL_RELINQ_TOPIC, MAX_ANGULAR_SPEED, MAX_LINEAR_SPEED, PRINTED_RESET, SET_POSE_SERVICE)
from tb3_labs.marking.labs import stimuli
from tb3_labs.marking.labs.criteria import (
    ANY_BOUNDS, EXTRAS, ROUNDING_TOLERANCE, START_LIMITS, STOP_LIMITS, ZERO_BOUNDS, ZERO_TOLERANCE,
    Bounds, Criterion, Reason, clean_exit_criterion, judge_start, judge_steering, judge_stop,
    judge_stop_at_ctrl_c, lost_device_criterion, scaled, within)
from tb3_labs.marking.trial.observation import ANGULAR, LINEAR, TIME, NotObserved, Observation
from tb3_labs.marking.trial.remarks import clause_on_other_topics, exceptions_in, last_line
from tb3_labs.watch.lab_mistakes import GAMEPAD_SECTION

FULL_LINEAR_BOUNDS = (0.15, MAX_LINEAR_SPEED + ROUNDING_TOLERANCE)     # [m/s], for a full stick
FULL_ANGULAR_BOUNDS = (1.5, MAX_ANGULAR_SPEED + ROUNDING_TOLERANCE)    # [rad/s]
#: A stick that is half way must command a share of the full speed that is between these bounds.
HALF_STICK_SHARES = (0.25, 0.75)
#: A node that does not wait for a service follows a stick within this time [s]. A wait for a
#: service takes 1 s or more.
UNBLOCKED_TIME = 0.7
HANDOUT_PAD = 'handout'
Y_STEP = GAMEPAD_SECTION.at_step(3)


def pad_called(name: str) -> Dict[str, int]:
    """Returns {name of an axis or a button: number} of a pad. Raises ``ValueError`` with the valid
    names if no pad has this name."""
    folder = Path(rospkg.RosPack().get_path('tb3_labs')) / 'launch' / 'params'
    path_by_name = {path.stem[len('pad_'):]: path for path in folder.glob('pad_*.yaml')}
    if name not in path_by_name:
        raise ValueError(f"there is no pad {name!r}; valid: {', '.join(sorted(path_by_name))}")
    return dict(yaml.safe_load(path_by_name[name].read_text(encoding='utf-8')))


def pad_text(name: str) -> str:
    """Returns a sentence with the pad's name and the numbers of its axes and buttons."""
    return ('The pad was "{}": axis {linear_axis} drives, axis {angular_axis} turns; button '
            '{relinquish_button} is A, {regain_button} is B, {reset_button} is Y.').format(
                name, **pad_called(name))


def _judge_stick(observation, column, positive, negative, full_bounds, full_stimulus):
    """Judges a stick that commands a `column`, LINEAR or ANGULAR. The stick is at its two ends in
    the stimuli `positive` and `negative`. In BOTH_STICKS the stick is pushed half way, in the same
    direction as fully in the stimulus `full_stimulus`."""
    def judge(name, bounds, other_bounds=ZERO_BOUNDS):
        if column == LINEAR:
            return judge_steering(observation, name, linear=bounds, angular=other_bounds)
        return judge_steering(observation, name, linear=other_bounds, angular=bounds)
    reason = judge(positive, full_bounds) or judge(negative, scaled(full_bounds, -1.0))
    if reason:
        return reason
    full_speed = observation.enter_scene(full_stimulus).commands[-1, column]
    return judge(stimuli.BOTH_STICKS, scaled(HALF_STICK_SHARES, full_speed), ANY_BOUNDS)


def _judge_stop_when_let_go(observation: Observation) -> Reason:
    if not len(observation.enter_scene(stimuli.BOTH_STICKS).moving_commands):
        raise NotObserved('the sticks did not move the robot before they were let go')
    return judge_stop(observation, stimuli.STICKS_LET_GO, 'the sticks were let go')


def _judge_ctrl_relinq(observation: Observation, name: str, expected: bool) -> Reason:
    scene = observation.enter_scene(name)
    published = scene.facts[stimuli.RELINQ_VALUE]
    if published is expected:
        return ''
    if published is not None:
        return f'after {name} it published {published} on ctrl_relinq'
    reason = f'after {name} nothing was published on ctrl_relinq'
    instead = clause_on_other_topics(scene.process, CTRL_RELINQ_TOPIC)
    return f'{reason}: {instead}' if instead else reason


def _require_hand_over(observation):
    if _judge_ctrl_relinq(observation, stimuli.HAND_OVER, expected=True):
        raise NotObserved('A did not hand the robot over')


def _judge_silence(observation: Observation) -> Reason:
    _require_hand_over(observation)
    if not len(observation.enter_scene(stimuli.STICK_UP_AFTER_A).commands):
        return ''
    return 'the stick still sent velocities while the robot was handed over'


def _judge_regain(observation: Observation) -> Reason:
    _require_hand_over(observation)
    reason = _judge_ctrl_relinq(observation, stimuli.TAKE_BACK, expected=False)
    if reason:
        return reason
    if len(observation.enter_scene(stimuli.STICK_UP_AFTER_B).moving_commands):
        return ''
    return 'after B the stick did not move the robot'


def _judge_reset_call(observation: Observation) -> Reason:
    scene = observation.enter_scene(stimuli.RESET_BUTTON)
    facts = scene.facts
    if not facts[stimuli.CALL_COUNT]:
        printed = (f'{last_line(scene.printed)}: has its client one of these names?'
                   if scene.printed.strip() else 'nothing: does it read the button of Y?')
        return ('after Y no reset service was called (reset_pose, set_pose, reset, ... were '
                f'there), and it printed {printed}')
    if facts[stimuli.SERVICE_NAME] != SET_POSE_SERVICE:
        return (f'after Y it called {facts[stimuli.SERVICE_NAME]}, not /{SET_POSE_SERVICE}, which '
                'move2goal_tf.py offers')
    if not facts[stimuli.IS_ORIGIN]:
        reason = 'after Y the reset was called with another pose than (0, 0, 0)'
        for fields in facts.get(stimuli.NONZERO_FIELDS, ()):
            if fields:
                return f"{reason}: {', '.join(fields)}"
        return reason
    if facts[stimuli.IS_UNIT]:
        return ''
    return ('after Y the orientation of the call was not a rotation: its quaternion is not of '
            'length 1')


def _judge_blocking(observation: Observation) -> Reason:
    scene = observation.enter_scene(stimuli.RESET_WITHOUT_SERVICE)
    if not len(scene.moving_commands):
        return 'after Y without a reset service the stick did not drive any more'
    delay = scene.moving_commands[0, TIME] - scene.begin
    if delay <= UNBLOCKED_TIME:
        return ''
    return f'after Y without a reset service the stick did not drive for {delay:.1f} s'


def _judge_printed_error(observation: Observation) -> Reason:
    scene = observation.enter_scene(stimuli.RESET_WITHOUT_SERVICE)
    if exceptions_in(scene):
        return 'after Y without a reset service there was a traceback'
    if PRINTED_RESET.lower() in scene.printed.lower():
        return f'after Y without a reset service it said "{PRINTED_RESET}"'
    if scene.printed.strip():
        return ''
    reason = ('after Y without a reset service nothing was printed within '
              f'{scene.end - scene.begin:.1f} s')
    if not len(scene.moving_commands):
        reason += ', and the stick did not drive: does it wait for the service without a timeout?'
    return reason


def _judge_printed_success(observation: Observation) -> Reason:
    printed = observation.enter_scene(stimuli.RESET_BUTTON).printed
    if PRINTED_RESET.lower() in printed.lower():
        return ''
    return f'"{PRINTED_RESET}." was not printed after Y'


def _judge_latching(observation: Observation) -> Reason:
    if observation.enter_scene(stimuli.HAND_OVER).facts[stimuli.IS_LATCHED]:
        return ''
    return 'a subscriber that came after A heard nothing on ctrl_relinq'


def _judge_call_count(observation: Observation) -> Reason:
    call_count = observation.enter_scene(stimuli.RESET_BUTTON).facts[stimuli.CALL_COUNT]
    return '' if call_count == 1 else f'Y, held for a moment, called the reset {call_count} times'


def _stick_limits(bounds: Bounds, unit: str) -> str:
    return (f'{bounds[0]:g} to {bounds[1]:g} {unit} {within(stimuli.STICK_HOLD_TIME)}, and at most '
            f'{ZERO_TOLERANCE:g} of the other speed; half way, beside the other stick, '
            f'{HALF_STICK_SHARES[0]:g} to {HALF_STICK_SHARES[1]:g} of full')


CRITERIA = [
    Criterion('starts', stimuli.STICKS, 'runs and listens to joy', GAMEPAD_SECTION, judge_start,
              limits=START_LIMITS),
    Criterion('drives', stimuli.STICKS,
              f'left stick drives forward and back, at most {MAX_LINEAR_SPEED:g} m/s',
              GAMEPAD_SECTION,
              partial(_judge_stick, column=LINEAR, positive=stimuli.LEFT_STICK_UP,
                      negative=stimuli.LEFT_STICK_DOWN, full_stimulus=stimuli.LEFT_STICK_UP,
                      full_bounds=FULL_LINEAR_BOUNDS),
              limits=_stick_limits(FULL_LINEAR_BOUNDS, 'm/s')),
    Criterion('turns', stimuli.STICKS,
              f'right stick turns left and right, at most {MAX_ANGULAR_SPEED:g} rad/s',
              GAMEPAD_SECTION,
              partial(_judge_stick, column=ANGULAR, positive=stimuli.RIGHT_STICK_LEFT,
                      negative=stimuli.RIGHT_STICK_RIGHT, full_stimulus=stimuli.RIGHT_STICK_RIGHT,
                      full_bounds=FULL_ANGULAR_BOUNDS),
              limits=_stick_limits(FULL_ANGULAR_BOUNDS, 'rad/s')),
    Criterion('lets_go', stimuli.STICKS, 'the robot stops when the sticks are let go',
              GAMEPAD_SECTION, _judge_stop_when_let_go, limits='zero velocity ' + STOP_LIMITS),
    Criterion('relinquishes', stimuli.BUTTONS, 'A publishes True on ctrl_relinq', GAMEPAD_SECTION,
              partial(_judge_ctrl_relinq, name=stimuli.HAND_OVER, expected=True),
              limits=within(stimuli.PUBLISH_TIME)),
    Criterion('silent_meanwhile', stimuli.BUTTONS,
              'sends no velocity while the robot is handed over', GAMEPAD_SECTION, _judge_silence,
              limits=f'the stick is up for {stimuli.STICK_HOLD_TIME:g} s'),
    Criterion('regains', stimuli.BUTTONS,
              'B publishes False on ctrl_relinq, and the sticks drive again', GAMEPAD_SECTION,
              _judge_regain, limits=f'{within(stimuli.PUBLISH_TIME)}; the stick '
              f'{within(stimuli.STICK_HOLD_TIME)}'),
    Criterion('resets', stimuli.BUTTONS, f'Y calls /{SET_POSE_SERVICE} with (0, 0, 0)', Y_STEP,
              _judge_reset_call,
              limits=f'{within(stimuli.CALL_AFTER_Y_TIME)}, by a quaternion of length 1'),
    Criterion('says_success', stimuli.BUTTONS, f'says "{PRINTED_RESET}." after Y', Y_STEP,
              _judge_printed_success, limits=within(stimuli.CALL_AFTER_Y_TIME)),
    clean_exit_criterion(stimuli.BUTTONS, GAMEPAD_SECTION),
    Criterion('says_why_not', stimuli.NO_SERVICE, 'says why the reset failed without a service',
              GAMEPAD_SECTION, _judge_printed_error, limits=within(stimuli.CALL_AFTER_Y_TIME)),
    Criterion('stops_robot', stimuli.BUTTONS, 'at Ctrl+C while driving sends zero velocity', EXTRAS,
              judge_stop_at_ctrl_c, is_extra=True, limits=STOP_LIMITS),
    Criterion('not_blocked', stimuli.NO_SERVICE, 'Y without a service does not block the sticks',
              EXTRAS, _judge_blocking, is_extra=True,
              limits='the stick drives ' + within(UNBLOCKED_TIME)),
    Criterion('once', stimuli.BUTTONS, 'a long Y is one call', EXTRAS, _judge_call_count,
              is_extra=True),
    Criterion('latched', stimuli.BUTTONS, 'ctrl_relinq is latched', EXTRAS, _judge_latching,
              is_extra=True, limits='heard ' + within(stimuli.PUBLISH_TIME)),
    lost_device_criterion('lost_pad', 'stops the robot', 'the pad', stimuli.PAD_SILENT, EXTRAS),
]
