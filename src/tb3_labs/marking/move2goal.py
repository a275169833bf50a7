"""The Transformation lab: driving to a goal in a frame that can be reset."""
import math
import re

import numpy as np

from tb3_labs.geometry.angles import wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.criteria import Criterion, Place
from tb3_labs.marking.life import clean_exit, starts, stops_robot

#: The handout's goal: x, y [m], heading [rad].
GOAL = (-0.61, 0.61, 0.0)
#: The handout's distance and angle, and what a robot may go on after it was stopped [m], [deg].
DISTANCE, ANGLE = 0.15, math.degrees(0.05)
MORE_DISTANCE, MORE_ANGLE = 0.02, 2.0
#: The same, beyond the handout [m], [deg].
EXACT_DISTANCE, EXACT_ANGLE = 0.02, 1.0
#: What the robot can do, by its data sheet [m/s], [rad/s], and what rounding may add.
FASTEST, FASTEST_TURN, ROUNDING = 0.22, 2.84, 0.005
#: A drive takes no longer than this [s], and goes no farther away than that [m].
DRIVE_TIME, ASTRAY = 50.0, 3.0
#: A stop "at once" takes no longer than this [s]; one by a lost sensor no longer than that.
AT_ONCE, LOST = 0.5, 1.0
#: Silence at the goal begins so long after the arrival [s].
LAST_WORD = 0.5
REACHED = re.compile(r'goal reached', re.IGNORECASE)
SET = re.compile(r'local pose set', re.IGNORECASE)

SHEET = 'transformation_lab.md'
STATES, RESET, DEMONSTRATION, ANALYSIS, THUMB, THEORY = (Place(SHEET, heading) for heading in (
    '1. The node and its states', '2. The reset', '4. The demonstration to hand in', '5. Analysis',
    '3. By thumb', 'Transformation lab: drive to a goal in a frame of your own'))


def _end(seen, name):
    """Where a drive ended, in the local frame, and whether it rests there."""
    scene = seen.during(name)
    local_T_world = Pose2(*scene.facts['local_T_world'])
    return local_T_world @ Pose2(*scene.truth[-1, 1:]), scene.facts['rested']


def _not_driven(seen, name):
    scene = seen.during(name)
    return '' if scene.facts['moved'] else 'the robot, given to it, did not move'


def _place(seen, name, tolerance=DISTANCE + MORE_DISTANCE):
    missed = _not_driven(seen, name)
    if missed:
        return missed
    end, rests = _end(seen, name)
    away = end.distance_to(Pose2(*GOAL))
    if not rests:
        return 'it was still moving after {:.0f} s, {:.2f} m from the goal'.format(
            seen.during(name).end - seen.during(name).begin, away)
    return '' if away <= tolerance else 'it stopped {:.2f} m from the goal'.format(away)


def _heading(seen, name, tolerance=ANGLE + MORE_ANGLE):
    missed = _not_driven(seen, name)
    if missed:
        return missed
    end, rests = _end(seen, name)
    if not rests:
        return 'it was still moving after {:.0f} s'.format(
            seen.during(name).end - seen.during(name).begin)
    faces = math.degrees(wrap(end.yaw - GOAL[2]))
    return '' if abs(faces) <= tolerance else \
        'at its end it faced {:.1f} degrees instead of 0'.format(faces)


def waits(seen):
    """Nothing moves before it was given control."""
    return 'it moved the robot without having control' if len(
        seen.during('without control').moving) else ''


def goal_place(seen):
    """The first drive ends near the goal."""
    return _place(seen, 'first drive')


def goal_heading(seen):
    """And faces its heading."""
    return _heading(seen, 'first drive')


def says_reached(seen):
    """The line at the goal, once."""
    number = len(REACHED.findall(seen.during('first drive').printed
                                 + seen.during('at the goal').printed))
    return '' if number == 1 else '"Goal reached!" was printed {} times'.format(number)


def silent_at_goal(seen):
    """Nothing is sent any more, so that another may drive."""
    missed = _not_driven(seen, 'first drive')
    if missed:
        return missed
    scene = seen.during('at the goal')
    late = scene.commands[scene.commands[:, 0] > scene.begin + LAST_WORD]
    return 'it went on sending commands on cmd_vel after it had arrived' if len(late) else ''


def within_limits(seen):
    """No more is commanded than a robot can do."""
    commands = np.vstack([seen.during(name).commands for name in ('first drive', 'second drive')
                          if seen.has(name)] or [seen.during('first drive').commands])
    if not len(commands):
        return 'it commanded nothing'
    forward, turn = np.abs(commands[:, 1:]).max(axis=0)
    return '' if forward <= FASTEST + ROUNDING and turn <= FASTEST_TURN + ROUNDING else \
        'it commanded up to {:.2f} m/s and {:.1f} rad/s'.format(forward, turn)


def resets(seen):
    """A service declares where the robot is."""
    problem = seen.during('reset').facts['problem']
    return 'the reset failed: ' + problem if problem else ''


def says_reset(seen):
    """The line that tells of it."""
    return '' if SET.search(seen.during('reset').printed) else \
        'no line "Local pose set to x=..., y=..., yaw=..." was printed'


def second_place(seen):
    """The same task again, from another place and heading."""
    return resets(seen) or _place(seen, 'second drive')


def second_heading(seen):
    """And faces its heading."""
    return resets(seen) or _heading(seen, 'second drive')


def control_taken(seen):
    """It stops when control is taken."""
    scene = seen.during('control taken')
    if not scene.facts['was_moving']:
        return 'the robot, given to it, did not move, so that it could not be stopped'
    late = scene.moving[scene.moving[:, 0] > scene.begin + AT_ONCE]
    if len(late):
        return 'it drove on for more than {:g} s after control had been taken'.format(AT_ONCE)
    if not len(scene.commands) or scene.commands[-1, 1:].any():
        return 'it sent no zero velocity when control was taken'
    return ''


def exact(seen):
    """Both drives, several times as exact as the handout asks for."""
    return next((said for said in (
        said for name in ('first drive', 'second drive')
        for said in (_place(seen, name, EXACT_DISTANCE), _heading(seen, name, EXACT_ANGLE)))
        if said), '')


def offset_imu(seen):
    """An IMU whose zero is another than the odometry's."""
    return _place(seen, 'drive with an offset IMU') or _heading(seen, 'drive with an offset IMU')


def declared_pose(seen):
    """A declared pose that is not zero."""
    problem = seen.during('reset to another pose').facts['problem']
    if problem:
        return 'the reset failed: ' + problem
    return _place(seen, 'drive from a declared pose') or _heading(
        seen, 'drive from a declared pose')


def lost_odometry(seen):
    """Silent odometry stops the drive."""
    scene = seen.during('odometry silent')
    if not scene.facts['was_moving']:
        return 'the robot was not moving when the odometry fell silent'
    return 'it drove on for more than {:g} s after the odometry had fallen silent'.format(
        LOST) if len(scene.moving[scene.moving[:, 0] > scene.begin + LOST]) else ''


CRITERIA = [
    Criterion('starts', 'drive', 'runs and listens to odom', STATES, starts),
    Criterion('waits', 'drive', 'does not move before it has control', STATES, waits),
    Criterion('goal_place', 'drive', 'drives to (-0.61, 0.61), within 0.15 m', STATES, goal_place),
    Criterion('goal_heading', 'drive', 'faces 0 degrees there, within 0.05 rad', STATES,
              goal_heading),
    Criterion('says_reached', 'drive', 'says "Goal reached!" once', STATES, says_reached),
    Criterion('silent_at_goal', 'drive', 'then is silent on cmd_vel', THUMB, silent_at_goal),
    Criterion('within_limits', 'drive', "keeps the robot's limits, 0.22 m/s and 2.84 rad/s",
              STATES, within_limits),
    Criterion('resets', 'reset', 'a service resets the local frame', RESET, resets),
    Criterion('says_reset', 'reset', 'says "Local pose set to x=..., y=..., yaw=..."', RESET,
              says_reset),
    Criterion('second_place', 'reset', 'the same task after a reset, elsewhere, within 0.15 m',
              DEMONSTRATION, second_place),
    Criterion('second_heading', 'reset', 'faces 0 degrees of the new frame, within 0.05 rad',
              DEMONSTRATION, second_heading),
    Criterion('control_taken', 'control', 'stops at once when control is taken', STATES,
              control_taken),
    Criterion('stops_robot', 'control', 'Ctrl+C in a drive: zero velocity', STATES, stops_robot),
    Criterion('clean_exit', 'control', 'Ctrl+C: ends by itself, without a traceback', STATES,
              clean_exit),
    Criterion('exact', 'reset', 'both drives within 0.02 m and 1 degree', ANALYSIS, exact,
              extra=True),
    Criterion('declared_pose', 'declared', 'a declared pose that is not zero is honoured', RESET,
              declared_pose, extra=True),
    Criterion('offset_imu', 'offset', "an IMU whose zero is not the odometry's", THEORY,
              offset_imu, extra=True),
    Criterion('lost_odometry', 'lost', 'silent odometry stops it within 1 s', ANALYSIS,
              lost_odometry, extra=True),
]
