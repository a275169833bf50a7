"""The stimuli and the criteria of the gamepad in the Transformation lab: driving, handing the robot
over, resetting."""
from functools import partial
from pathlib import Path
from typing import Dict

import rospkg
import yaml

from tb3_labs.handout import (
    CTRL_RELINQ, MAX_ANGULAR_SPEED, MAX_LINEAR_SPEED, PRINTED_RESET, SET_POSE)
from tb3_labs.marking.labs.criteria import (
    ANGULAR, ANY, BEYOND, IN_TIME, LINEAR, NEAR, ROUNDING, STOPS_AT_ONCE, Criterion,
    Reason, ends_cleanly, not_stopped, starts, steers, stops_robot, stops_when_lost, times, within)
from tb3_labs.marking.trial.observation import NotObserved, Observation
from tb3_labs.marking.trial.remarks import exceptions_in, last_line, other_topics
from tb3_labs.watch.chains import BY_THUMB
from tb3_labs.watch.input_links import FORWARD_STICK, TURNING_STICK

#: The parts of the lab.
STICKS, BUTTONS, NO_SERVICE = 'sticks', 'buttons', 'no service'
#: The stimuli of the sticks, in their order.
UP, DOWN = FORWARD_STICK, 'left stick down'
BOTH = 'left stick half up, right stick half right'
TO_LEFT, TO_RIGHT = TURNING_STICK, 'right stick right'
LET_GO = 'sticks let go'
#: stimulus -> (how far the left stick is up, how far the right stick is left), each -1 to 1
PLACES = {UP: (1.0, 0.0), DOWN: (-1.0, 0.0), TO_LEFT: (0.0, 1.0), TO_RIGHT: (0.0, -1.0),
          BOTH: (0.5, -0.5), LET_GO: (0.0, 0.0)}
#: The stimulus of the axes that have no function. It shows which axis a wrong node follows; no
#: criterion judges it.
OTHER_AXES = 'other axes'
#: The stimuli of the buttons.
HAND_OVER, UP_HANDED_OVER, TAKE_BACK, UP_TAKEN_BACK = (
    'A', 'left stick up after A', 'B', 'left stick up after B')
RESET_BUTTON, RESET_WITHOUT_SERVICE = 'Y', 'Y without a service'
PAD_SILENT = 'pad silent'
#: Keys of the facts of A and B. RELINQUISHED: the latest value on ctrl_relinq, None if no message
#: came. LATCHED, of A alone: did a late subscriber get the value?
#: Keys of the facts of Y. CALLS: the number of calls. NAME: the name of the called service.
#: ORIGIN: did each call declare (0, 0, 0)? UNIT: was the quaternion of each call of length 1?
RELINQUISHED, LATCHED = 'relinquished', 'heard late'
CALLS, ORIGIN, UNIT, NAME = 'calls', 'origin', 'unit', 'name'

#: The least and the greatest command of a full stick [m/s], [rad/s].
FORWARD, TURN_RANGE = (0.15, MAX_LINEAR_SPEED + ROUNDING), (1.5, MAX_ANGULAR_SPEED + ROUNDING)
#: The least and the greatest command of a half stick, as a share of the full stick's command.
HALF = (0.25, 0.75)
#: A node that is not blocked follows a stick within this time [s]. A wait for a service takes 1 s.
PROMPT = 0.7
#: A stick is held for HELD [s]. A value comes on ctrl_relinq within PUBLISH_TIME [s]. A reset is
#: called, or has failed, within RESET_TIME [s].
HELD, PUBLISH_TIME, RESET_TIME = 0.8, 1.0, 2.5
#: The limits of the sticks, in words.
STICK_LIMITS = '{:g} to {:g} {} within {:g} s, and at most {:g} of the other speed; half way, ' \
    'beside the other stick, {:g} to {:g} of full'
#: The default of the option: the pad that the marker plays.
HANDOUT = 'handout'
#: The step that names the mistakes of a reset.
Y_STEP = BY_THUMB.at_step(3)


def pad_called(name: str) -> Dict[str, int]:
    """Returns the numbers of the axes and buttons of a pad. Raises ``ValueError`` with the valid
    names if there is no such pad."""
    folder = Path(rospkg.RosPack().get_path('tb3_labs')) / 'launch' / 'params'
    known = {path.stem[len('pad_'):]: path for path in folder.glob('pad_*.yaml')}
    if name not in known:
        raise ValueError(f"there is no pad {name!r}; valid: {', '.join(sorted(known))}")
    return dict(yaml.safe_load(known[name].read_text(encoding='utf-8')))


def pad_text(name: str) -> str:
    """Returns a sentence on the pad and the numbers of its axes and buttons."""
    return ('The pad was "{}": axis {linear_axis} drives, axis {angular_axis} turns; button '
            '{relinquish_button} is A, {regain_button} is B, {reset_button} is Y.').format(
                name, **pad_called(name))


def _drives(observation: Observation) -> Reason:
    return (steers(observation, UP, FORWARD) or steers(observation, DOWN, times(-1.0, FORWARD))
            or steers(
                observation, BOTH, times(observation.scene(UP).commands[-1, LINEAR], HALF), ANY))


def _turns(observation: Observation) -> Reason:
    return (steers(observation, TO_LEFT, angular=TURN_RANGE)
            or steers(observation, TO_RIGHT, angular=times(-1.0, TURN_RANGE)) or steers(
                observation, BOTH, ANY,
                times(observation.scene(TO_RIGHT).commands[-1, ANGULAR], HALF)))


def _lets_go(observation: Observation) -> Reason:
    if not len(observation.scene(TO_RIGHT).moving):
        raise NotObserved('the sticks did not move the robot at all')
    return not_stopped(observation.scene(LET_GO), 'the sticks were let go')


def _control(observation: Observation, name: str, wanted: bool) -> Reason:
    """Judges whether the latest value on ctrl_relinq after the button `name` is `wanted`."""
    scene = observation.scene(name)
    published = scene.facts[RELINQUISHED]
    if published is wanted:
        return ''
    if published is not None:
        return f'after {name} it published {published} on ctrl_relinq'
    return ': '.join(filter(None, [f'after {name} nothing was published on ctrl_relinq',
                                   other_topics(scene.run, CTRL_RELINQ)]))


def _require_hand_over(observation):
    if _control(observation, HAND_OVER, True):
        raise NotObserved('A did not hand the robot over')


def _silent_meanwhile(observation: Observation) -> Reason:
    _require_hand_over(observation)
    return 'the stick still sent velocities while the robot was handed over' if len(
        observation.scene(UP_HANDED_OVER).commands) else ''


def _regains(observation: Observation) -> Reason:
    _require_hand_over(observation)
    missed = _control(observation, TAKE_BACK, False)
    if missed or len(observation.scene(UP_TAKEN_BACK).moving):
        return missed
    return 'after B the stick did not move the robot'


def _resets(observation: Observation) -> Reason:
    scene = observation.scene(RESET_BUTTON)
    facts = scene.facts
    if not facts[CALLS]:
        printed = last_line(scene.printed) + ': has its client one of these names?' if (
            scene.printed.strip()) else 'nothing: does it read the button of Y?'
        return ('after Y no reset service was called (reset_pose, set_pose, reset, ... were '
                f'there), and it printed {printed}')
    if facts[NAME] != SET_POSE:
        return f'after Y it called {facts[NAME]}, not /{SET_POSE}, which move2goal_tf.py offers'
    if not facts[ORIGIN]:
        return 'after Y the reset was called with another pose than (0, 0, 0)'
    return '' if facts[UNIT] else \
        'after Y the orientation of the call was not a rotation: its quaternion is not of length 1'


def _not_blocked(observation: Observation) -> Reason:
    scene = observation.scene(RESET_WITHOUT_SERVICE)
    moving = scene.moving
    if len(moving) and moving[0, 0] - scene.begin <= PROMPT:
        return ''
    return 'after Y without a reset service the stick did not drive {}'.format(
        'any more' if not len(moving) else 'for {:.1f} s'.format(moving[0, 0] - scene.begin))


def _says_why_not(observation: Observation) -> Reason:
    scene = observation.scene(RESET_WITHOUT_SERVICE)
    if exceptions_in(scene):
        return 'after Y without a reset service there was a traceback'
    if PRINTED_RESET.lower() in scene.printed.lower():
        return f'after Y without a reset service it said "{PRINTED_RESET}"'
    if scene.printed.strip():
        return ''
    blocked = '' if len(scene.moving) else \
        ', and the stick did not drive: does it wait for the service without a timeout?'
    return ('after Y without a reset service nothing was printed within '
            f'{scene.end - scene.begin:.1f} s{blocked}')


def _once(observation: Observation) -> Reason:
    calls = observation.scene(RESET_BUTTON).facts[CALLS]
    return '' if calls == 1 else f'Y, held for a moment, called the reset {calls} times'


CRITERIA = [
    Criterion('starts', STICKS, 'runs and listens to joy', BY_THUMB, starts, limits=IN_TIME),
    Criterion('drives', STICKS, 'left stick drives forward and back, at most {:g} m/s'.format(
        MAX_LINEAR_SPEED), BY_THUMB, _drives, limits=STICK_LIMITS.format(
            *FORWARD, 'm/s', HELD, NEAR, *HALF)),
    Criterion('turns', STICKS, 'right stick turns left and right, at most {:g} rad/s'.format(
        MAX_ANGULAR_SPEED), BY_THUMB, _turns, limits=STICK_LIMITS.format(
            *TURN_RANGE, 'rad/s', HELD, NEAR, *HALF)),
    Criterion('lets_go', STICKS, 'the robot stops when the sticks are let go', BY_THUMB, _lets_go,
              limits='zero velocity ' + STOPS_AT_ONCE),
    Criterion('relinquishes', BUTTONS, 'A publishes True on ctrl_relinq', BY_THUMB,
              partial(_control, name=HAND_OVER, wanted=True), limits=within(PUBLISH_TIME)),
    Criterion('silent_meanwhile', BUTTONS, 'sends no velocity while the robot is handed over',
              BY_THUMB, _silent_meanwhile, limits=f'the stick is up for {HELD:g} s'),
    Criterion('regains', BUTTONS, 'B publishes False on ctrl_relinq, and the sticks drive again',
              BY_THUMB, _regains, limits=f'within {PUBLISH_TIME:g} s; the stick within {HELD:g} s'),
    Criterion('resets', BUTTONS, f'Y calls /{SET_POSE} with (0, 0, 0)', Y_STEP, _resets,
              limits=within(RESET_TIME) + ', by a quaternion of length 1'),
    Criterion('says_success', BUTTONS, f'says "{PRINTED_RESET}." after Y', Y_STEP,
              lambda observation: '' if PRINTED_RESET.lower() in observation.scene(
                  RESET_BUTTON).printed.lower() else
              f'"{PRINTED_RESET}." was not printed after Y',
              limits=within(RESET_TIME)),
    ends_cleanly(BUTTONS, BY_THUMB),
    Criterion('says_why_not', NO_SERVICE, 'says why the reset failed without a service', BY_THUMB,
              _says_why_not, limits=within(RESET_TIME)),
    Criterion('stops_robot', BUTTONS, 'at Ctrl+C while driving sends zero velocity', BEYOND,
              stops_robot, extra=True, limits=STOPS_AT_ONCE),
    Criterion('not_blocked', NO_SERVICE, 'Y without a service does not block the sticks', BEYOND,
              _not_blocked, extra=True, limits='the stick drives ' + within(PROMPT)),
    Criterion('once', BUTTONS, 'Y, held, is one call', BEYOND, _once, extra=True),
    Criterion('latched', BUTTONS, 'ctrl_relinq is latched', BEYOND,
              lambda observation: '' if observation.scene(HAND_OVER).facts[LATCHED] else
              'a subscriber that came after A heard nothing on ctrl_relinq', extra=True,
              limits='heard ' + within(PUBLISH_TIME)),
    stops_when_lost('lost_pad', 'stops the robot', 'the pad', PAD_SILENT, BEYOND),
]
