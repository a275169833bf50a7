"""The Transformation lab's gamepad: driving, handing the robot over, resetting."""
import numpy as np

from tb3_labs.marking.criteria import Criterion, Place
from tb3_labs.marking.life import TRACEBACK, clean_exit, starts, stops_robot
from tb3_labs.marking.observation import NotSeen

#: What full sticks command: at least, at most [m/s], [rad/s].
FORWARD, TURN = (0.15, 0.225), (1.5, 2.845)
#: A stick half way commands this part of what it commands at its end.
HALF = (0.25, 0.75)
#: A stop "at once" takes no longer than this [s]; one by a lost pad no longer than that.
AT_ONCE, LOST = 0.5, 1.0
#: A node that is not blocked obeys a stick within this time [s]; waiting for a service takes 1 s.
PROMPT = 0.7
#: What else it commands meanwhile is less than this.
NEAR = 0.05
SUCCESS = 'Pose reset successfully'

SHEET = 'transformation_lab.md'
THUMB, STATES = Place(SHEET, '3. By thumb'), Place(SHEET, '1. The node and its states')


def _stick(seen, name, column, sign, bounds):
    """'' if the newest command of a stimulus is as it should be, else what it was."""
    commands = seen.during(name).commands
    if not len(commands) or not commands[-1, 1:].any():
        return 'with the {} nothing was commanded'.format(name)
    if not bounds[0] <= sign * commands[-1, column] <= bounds[1] or (
            abs(commands[-1, 3 - column]) > NEAR):
        return 'with the {} it commanded {:.2f} m/s and {:.2f} rad/s'.format(
            name, *commands[-1, 1:])
    return ''


def drives(seen):
    """The left stick drives: forward, half as fast, backward."""
    missed = _stick(seen, 'left stick up', 1, 1.0, FORWARD)
    if missed:
        return missed
    full = seen.during('left stick up').commands[-1, 1]
    return _stick(seen, 'left stick half up', 1, 1.0, (HALF[0] * full, HALF[1] * full)) or _stick(
        seen, 'left stick down', 1, -1.0, FORWARD)


def turns(seen):
    """The right stick turns."""
    return _stick(seen, 'right stick left', 2, 1.0, TURN) or _stick(
        seen, 'right stick right', 2, -1.0, TURN)


def lets_go(seen):
    """Sticks in their middle stop the robot."""
    scene = seen.during('sticks let go')
    if not len(seen.during('right stick right').moving):
        raise NotSeen('the sticks did not move the robot at all')
    late = scene.moving[scene.moving[:, 0] > scene.begin + AT_ONCE]
    return 'the robot was still driven {:g} s after the sticks were let go'.format(
        AT_ONCE) if len(late) else ''


def _control(scene, wanted):
    said = scene.facts['relinquished']
    if said is wanted:
        return ''
    return 'nothing was published on ctrl_relinq' if said is None else \
        'it published {} on ctrl_relinq'.format(said)


def relinquishes(seen):
    """A hands the robot over."""
    missed = _control(seen.during('A'), True)
    return 'after A ' + missed if missed else ''


def silent_meanwhile(seen):
    """No velocity is sent while the robot is handed over."""
    scene = seen.during('left stick up after A')
    if _control(seen.during('A'), True):
        raise NotSeen('A did not hand the robot over')
    return 'while the robot was handed over, the stick still sent velocities' if len(
        scene.commands) else ''


def regains(seen):
    """B takes the robot back."""
    if _control(seen.during('A'), True):
        raise NotSeen('A did not hand the robot over')
    missed = _control(seen.during('B'), False)
    if missed:
        return 'after B ' + missed
    return '' if len(seen.during('left stick up after B').moving) else \
        'after B the stick did not move the robot'


def resets(seen):
    """Y calls a reset service with (0, 0, 0)."""
    facts = seen.during('Y').facts
    if not facts['calls']:
        return 'after Y no reset service was called (reset_pose, set_pose, reset, ... were there)'
    return '' if facts['origin'] else \
        'after Y the reset was called with another pose than (0, 0, 0)'


def says_success(seen):
    """It says that the reset succeeded."""
    return '' if SUCCESS.lower() in seen.during('Y').printed.lower() else \
        '"{}." was not printed after Y'.format(SUCCESS)


def not_blocked(seen):
    """A missing service does not keep it from driving."""
    scene = seen.during('Y without a service')
    moving = scene.moving
    if len(moving) and moving[0, 0] - scene.begin <= PROMPT:
        return ''
    return 'after Y without a reset service the stick did not drive {}'.format(
        'any more' if not len(moving) else 'for {:.1f} s'.format(moving[0, 0] - scene.begin))


def says_why_not(seen):
    """It says why the reset failed."""
    scene = seen.during('Y without a service')
    if TRACEBACK.search(scene.printed):
        return 'after Y without a reset service there was a traceback'
    return '' if scene.printed.strip() else \
        'after Y without a reset service nothing was printed within {:.1f} s'.format(
            scene.end - scene.begin)


def once(seen):
    """A button that is held is one press."""
    calls = seen.during('Y').facts['calls']
    return '' if calls == 1 else 'Y, held for a moment, called the reset {} times'.format(calls)


def latched(seen):
    """Who comes late learns who may drive."""
    return '' if seen.during('A').facts['latched'] else \
        'a subscriber that came after A heard nothing on ctrl_relinq'


def lost_pad(seen):
    """A pad that falls silent stops the robot."""
    scene = seen.during('pad silent')
    if not scene.facts['was_moving']:
        return 'the robot was not moving when the pad fell silent'
    return 'the robot was driven on for more than {:g} s after the pad had fallen silent'.format(
        LOST) if np.any(scene.moving[:, 0] > scene.begin + LOST) else ''


CRITERIA = [
    Criterion('starts', 'sticks', 'runs and listens to joy', THUMB, starts),
    Criterion('drives', 'sticks', 'left stick: forward and back, at most 0.22 m/s', THUMB, drives),
    Criterion('turns', 'sticks', 'right stick: left and right, at most 2.84 rad/s', THUMB, turns),
    Criterion('lets_go', 'sticks', 'stops the robot when the sticks are let go', THUMB, lets_go),
    Criterion('relinquishes', 'buttons', 'A: True on ctrl_relinq', STATES, relinquishes),
    Criterion('silent_meanwhile', 'buttons', 'then sends no velocity', THUMB, silent_meanwhile),
    Criterion('regains', 'buttons', 'B: False on ctrl_relinq, and the sticks drive again', THUMB,
              regains),
    Criterion('resets', 'buttons', 'Y: calls the reset with (0, 0, 0)', THUMB, resets),
    Criterion('says_success', 'buttons', 'says "{}."'.format(SUCCESS), THUMB, says_success),
    Criterion('stops_robot', 'buttons', 'Ctrl+C while driving: zero velocity', THUMB, stops_robot),
    Criterion('clean_exit', 'buttons', 'Ctrl+C: ends by itself, without a traceback', THUMB,
              clean_exit),
    Criterion('not_blocked', 'no service', 'Y without a service does not block the sticks', THUMB,
              not_blocked),
    Criterion('says_why_not', 'no service', 'says why the reset failed', THUMB, says_why_not),
    Criterion('once', 'buttons', 'Y, held, is one call', THUMB, once, extra=True),
    Criterion('latched', 'buttons', 'ctrl_relinq is latched', THUMB, latched, extra=True),
    Criterion('lost_pad', 'lost', 'a pad that falls silent stops the robot within 1 s', THUMB,
              lost_pad, extra=True),
]
