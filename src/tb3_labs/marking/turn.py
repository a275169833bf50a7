"""The IMU lab: turns by keyboard, beside the mouse."""
import re

import numpy as np

from tb3_labs.marking.criteria import Criterion, Place
from tb3_labs.marking.life import clean_exit, says, starts, stops_robot
from tb3_labs.marking.observation import NotSeen

GOODBYE = 'Controller exiting. Halting robot.'
#: name of the stimulus: what is typed, the turn it asks for [deg], heading where it begins [deg].
TURNS = {
    'l': ('l', 90.0, 40.0),
    'l across 180': ('l', 90.0, 130.0),
    'r across 180': ('r', -90.0, 220.0),
    'r': ('r', -90.0, 130.0),
    'r across 0': ('r', -90.0, 40.0),
}
BESIDE_MOUSE = 'l beside the mouse'
NONSENSE = 'x'
#: The handout's tolerance, and what a robot may go on after it was stopped [deg].
TOLERANCE, AFTER_STOP = 10.0, 1.0
#: The handout's fastest turn [rad/s], and what rounding may add.
FASTEST, ROUNDING = 1.5, 0.005
#: A turn takes no longer than this [s].
TURN_TIME = 8.0
#: Nobody reads an answer among more lines than this.
LEGIBLE = 1000
#: A stop "at once" takes no longer than this [s]; one by a lost sensor no longer than that.
AT_ONCE, LOST = 0.5, 1.0
#: What the edge of the screen commands [m/s], [rad/s], and how near to it is near enough.
FULL, NEAR = 0.5, 0.05

SHEET, HEADING = 'imu_lab.md', 'Lab: turn 90 and 180 degrees'
START, MOUSE, LAW, CTRL_C = (Place(SHEET, HEADING, step) for step in (1, 3, 4, 5))
WRAP = Place(SHEET, 'Exercise: the heading', 1)


def _turn(seen, name, tolerance=TOLERANCE + AFTER_STOP):
    """'' if the turn was one, else what was seen of it."""
    typed, asked = ('l', 90.0) if name == BESIDE_MOUSE else TURNS[name][:2]
    scene = seen.during(name)
    turned = scene.turned_deg
    where = '' if name in 'lr' else ' ({})'.format(name[2:])
    if not scene.facts['moved']:
        return 'after {}{} the robot did not turn'.format(typed, where)
    if not scene.facts['rested']:
        return 'after {}{} it turned {}, and was still moving after {:g} s'.format(
            typed, where, _degrees(turned), TURN_TIME)
    if abs(turned - asked) <= tolerance:
        return ''
    missed = 'after {}{} it turned {}, then stopped'.format(typed, where, _degrees(turned))
    if turned * asked <= 0.0:
        return missed
    return '{}: {:.1f} degrees {} the goal, where {:g} are allowed'.format(
        missed, abs(turned - asked), 'short of' if abs(turned) < abs(asked) else 'beyond',
        min(tolerance, TOLERANCE))


def _degrees(turned):
    number = '{:.1f}'.format(abs(turned))
    return number + ' degrees' if number == '0.0' else '{} degrees to the {}'.format(
        number, 'left' if turned > 0.0 else 'right')


def left(seen):
    """l: 90 degrees left."""
    return _turn(seen, 'l')


def right(seen):
    """r: 90 degrees right."""
    return _turn(seen, 'r')


def short_way(seen):
    """The same where the heading jumps."""
    return next((said for said in (_turn(seen, name) for name in TURNS if 'across' in name)
                 if said), '')


def _turning(seen):
    """The commands of all turns that were tried; NotSeen where there were none."""
    scenes = [seen.during(name) for name in TURNS if seen.has(name)] or [seen.during('l')]
    commands = np.vstack([scene.moving for scene in scenes])
    if not len(commands):
        raise NotSeen('the robot never was turned')
    return commands


def clamped(seen):
    """Never faster than MAX_ANG_Z."""
    fastest = np.abs(_turning(seen)[:, 2]).max()
    return '' if fastest <= FASTEST + ROUNDING else \
        'it commanded up to {:.1f} rad/s while turning'.format(fastest)


def on_the_spot(seen):
    """No forward speed while turning."""
    fastest = np.abs(_turning(seen)[:, 1]).max()
    return '' if fastest < ROUNDING else \
        'it commanded up to {:.2f} m/s forward while turning'.format(fastest)


def answers_nonsense(seen):
    """An error that names the valid inputs, and no movement."""
    scene = seen.during('nonsense')
    if len(scene.moving):
        return 'the robot moved after "{}" was typed'.format(NONSENSE)
    if scene.lines > LEGIBLE:
        return 'an answer to "{}" could not be read: {} lines were printed in {:.1f} s'.format(
            NONSENSE, scene.lines, scene.end - scene.begin)
    words = set(re.findall(r'[a-z]+', scene.printed.lower()))
    if not (words & {'l', 'left'} and words & {'r', 'right'}):
        return '"{}" was not answered by what is valid'.format(NONSENSE)
    return ''


def _mouse_drove(seen):
    if not len(seen.during('mouse up').moving):
        raise NotSeen('the mouse did not move the robot at all')


def mouse_drives(seen):
    """Up is forward, left is left, and half the way is half the speed."""
    _mouse_drove(seen)
    for name, column, sign, low, high in (
            ('mouse up', 1, 1.0, FULL - NEAR, FULL + NEAR), ('mouse left', 2, 1.0, FULL - NEAR,
                                                             FULL + NEAR),
            ('mouse half right', 2, -1.0, 0.2 * FULL, 0.8 * FULL)):
        scene = seen.during(name)
        commands = scene.moving
        if not len(commands):
            return 'with the {} nothing was commanded'.format(name)
        value = sign * commands[-1, column]
        if not low <= value <= high:
            return 'with the {} it commanded {:.2f} m/s and {:.2f} rad/s'.format(
                name, *commands[-1, 1:])
        other = 3 - column
        if abs(commands[-1, other]) > NEAR:
            return 'with the {} it commanded {:.2f} m/s and {:.2f} rad/s'.format(
                name, *commands[-1, 1:])
    return ''


def mouse_dead_zone(seen):
    """Nothing moves round the middle of the screen."""
    _mouse_drove(seen)
    scene = seen.during('mouse near the middle')
    late = scene.moving[scene.moving[:, 0] > scene.begin + AT_ONCE]
    return '' if not len(late) else \
        'with the mouse at (0.2, -0.2) it commanded {:.2f} m/s and {:.2f} rad/s'.format(
            *late[-1, 1:])


def mouse_off(seen):
    """Only an active mouse drives; deactivated it stops the robot at once."""
    if len(seen.during('mouse not active').moving):
        return 'the mouse moved the robot before it was activated'
    _mouse_drove(seen)
    scene = seen.during('mouse deactivated')
    if len(scene.moving[scene.moving[:, 0] > scene.begin + AT_ONCE]):
        return 'the robot was still driven {:g} s after the mouse was deactivated'.format(AT_ONCE)
    return ''


def turn_beside_mouse(seen):
    """A turn while the mouse is active, in the middle of the screen."""
    return _turn(seen, BESIDE_MOUSE)


def mouse_after_turn(seen):
    """The mouse drives when a turn is over."""
    return '' if len(_forward(seen, 'mouse after a turn')) else \
        'after a turn the mouse did not move the robot any more'


def mouse_in_turn(seen):
    """The mouse is not dead for good if it moves in the middle of a turn."""
    scene = seen.during('mouse in a turn')
    if not scene.facts['was_moving']:
        return 'there was no turn in the middle of which the mouse could be moved'
    return '' if len(_forward(seen, 'mouse in a turn')) else \
        'the mouse, moved in the middle of a turn, had not moved the robot {:.0f} s later'.format(
            scene.end - scene.begin)


def _forward(seen, name):
    commands = seen.during(name).commands
    return commands[commands[:, 1] > FULL - NEAR]


def says_goodbye(seen):
    """It says that it halts the robot."""
    return says(seen, GOODBYE)


def within_1_deg(seen):
    """All turns, ten times as exact as the handout asks for."""
    return next((said for said in (_turn(seen, name, 1.0) for name in TURNS) if said), '')


def lost_imu(seen):
    """A silent IMU stops a turn."""
    return _stops(seen, 'IMU silent', 'the IMU')


def lost_mouse(seen):
    """A mouse that falls silent stops the robot."""
    return _stops(seen, 'mouse silent', 'the mouse')


def _stops(seen, name, what):
    scene = seen.during(name)
    if not scene.facts['was_moving']:
        return 'the robot was not moving when {} fell silent'.format(what)
    late = scene.moving[scene.moving[:, 0] > scene.begin + LOST]
    return '' if not len(late) else \
        'the robot was driven on for more than {:g} s after {} had fallen silent'.format(LOST, what)


CRITERIA = [
    Criterion('starts', 'turns', 'runs and listens to imu', START, starts),
    Criterion('left', 'turns', 'l turns 90 degrees left, within 10', LAW, left),
    Criterion('right', 'turns', 'r turns 90 degrees right, within 10', LAW, right),
    Criterion('short_way', 'turns', 'the same where the heading jumps: across 180 and 0 degrees',
              WRAP, short_way),
    Criterion('clamped', 'turns', 'turns no faster than 1.5 rad/s', LAW, clamped),
    Criterion('on_the_spot', 'turns', 'does not drive forward meanwhile', LAW, on_the_spot),
    Criterion('answers_nonsense', 'turns', 'anything else: an error that names the valid inputs',
              START, answers_nonsense),
    Criterion('mouse_drives', 'mouse', 'up drives forward, left turns left, by 0.5 at the edge',
              MOUSE, mouse_drives),
    Criterion('mouse_dead_zone', 'mouse', 'nothing moves within 0.25 of the middle', MOUSE,
              mouse_dead_zone),
    Criterion('mouse_off', 'mouse', 'deactivated, the mouse stops the robot at once', MOUSE,
              mouse_off),
    Criterion('turn_beside_mouse', 'both', 'turns also while the mouse is active, in the middle',
              MOUSE, turn_beside_mouse),
    Criterion('mouse_after_turn', 'both', 'the mouse drives after a turn', MOUSE,
              mouse_after_turn),
    Criterion('mouse_in_turn', 'both', 'the mouse, moved during a turn, drives then or after it',
              MOUSE, mouse_in_turn),
    Criterion('stops_robot', 'shutdown', 'Ctrl+C in a turn: zero velocity', CTRL_C, stops_robot),
    Criterion('says_goodbye', 'shutdown', 'Ctrl+C: says "{}"'.format(GOODBYE), CTRL_C,
              says_goodbye),
    Criterion('clean_exit', 'shutdown', 'Ctrl+C: ends by itself, without a traceback', CTRL_C,
              clean_exit),
    Criterion('within_1_deg', 'turns', 'all turns within 1 degree', LAW, within_1_deg, extra=True),
    Criterion('lost_imu', 'lost', 'a silent IMU stops a turn within 1 s', CTRL_C, lost_imu,
              extra=True),
    Criterion('lost_mouse', 'lost', 'a mouse that falls silent stops the robot within 1 s', MOUSE,
              lost_mouse, extra=True),
]
