"""The Transformation lab: driving to a goal in a frame that can be reset. All that it asks for."""
import re

import numpy as np

from tb3_labs.marking import drives
from tb3_labs.marking.criteria import Criterion, Place, first_missed
from tb3_labs.marking.life import (CLEAN_EXIT, CLEAN_EXIT_LIMITS, IN_TIME, STOPS_IN_TIME, clean_exit,
                                   starts, stops_robot)
from tb3_labs.marking.observation import WAS_MOVING, Observation
from tb3_labs.marking.sheets import STATES, TRANSFORMATION_SHEET
from tb3_labs.marking.steering import ROUNDING
from tb3_labs.marking.stopping import (AT_ONCE, STOPS_AT_ONCE, STOPS_WHEN_LOST,
                                       stops_when_silent)

#: The parts of the lab.
DRIVE, RESET, CONTROL, DECLARED, OFFSET, LOST = (
    'drive', 'reset', 'control', 'declared', 'offset', 'lost')
#: The stimuli.
WITHOUT_CONTROL = 'without control'
FIRST_DRIVE = 'first drive'
AT_GOAL = 'at the goal'
RESET_TO_ORIGIN = 'reset to the origin'
SECOND_DRIVE = 'second drive'
CONTROL_TAKEN = 'control taken'
RESET_ELSEWHERE = 'reset to another pose'
DECLARED_DRIVE = 'drive from a declared pose'
OFFSET_DRIVE = 'drive with an offset IMU'
ODOMETRY_SILENT = 'odometry silent'
#: Key of a reset's facts: why it failed, '' if it did not.
PROBLEM = 'problem'

#: The robot's limits by its data sheet [m/s], [rad/s].
FASTEST, FASTEST_TURN = 0.22, 2.84
#: The node waits for control, and is watched at the goal, for this time [s].
WATCHED = 1.5
#: Silence at the goal begins this long after the arrival [s].
LAST_WORD = 0.5
#: A reset answers within this time, and has printed its line so much later [s].
ANSWER_TIME, TAKES_EFFECT = 3.0, 0.5
#: The turn of the robot before the reset [deg].
TURNED = 100.0
REACHED = re.compile(r'goal reached', re.IGNORECASE)
SET = re.compile(r'local pose set', re.IGNORECASE)

THEORY, AT_RESET, DEMONSTRATION, ANALYSIS = (
    Place(TRANSFORMATION_SHEET, heading) for heading in (
        'The theory', '3. The reset', '5. The demonstration to hand in', '6. Analysis'))
TWO_ZEROS = Place(TRANSFORMATION_SHEET, '1. The local pose', 4)


def waits(seen: Observation) -> str:
    """Does nothing move before the node has control?"""
    return 'it moved the robot without having control' if len(
        seen.during(WITHOUT_CONTROL).moving) else ''


def goal_place(seen: Observation) -> str:
    """Does the first drive end near the goal?"""
    return drives.place(seen, FIRST_DRIVE)


def goal_heading(seen: Observation) -> str:
    """Does the robot face the goal's heading there?"""
    return drives.heading(seen, FIRST_DRIVE)


def says_reached(seen: Observation) -> str:
    """Is the line at the goal printed once?"""
    number = len(REACHED.findall(seen.during(FIRST_DRIVE).printed + seen.during(AT_GOAL).printed))
    return '' if number == 1 else '"Goal reached!" was printed {} times'.format(number)


def silent_at_goal(seen: Observation) -> str:
    """Is cmd_vel silent at the goal, so that another node may drive?"""
    missed = drives.not_driven(seen.during(FIRST_DRIVE))
    if missed:
        return missed
    scene = seen.during(AT_GOAL)
    late = scene.commands[scene.commands[:, 0] > scene.begin + LAST_WORD]
    return 'it went on sending commands on cmd_vel after it had arrived' if len(late) else ''


def within_limits(seen: Observation) -> str:
    """Is no more commanded than the robot can do?"""
    commands = np.vstack([seen.during(name).commands for name in (FIRST_DRIVE, SECOND_DRIVE)
                          if seen.has(name)] or [seen.during(FIRST_DRIVE).commands])
    if not len(commands):
        return 'it commanded nothing'
    forward, turn = np.abs(commands[:, 1:]).max(axis=0)
    return '' if forward <= FASTEST + ROUNDING and turn <= FASTEST_TURN + ROUNDING else \
        'it commanded up to {:.2f} m/s and {:.1f} rad/s'.format(forward, turn)


def _reset(seen, name):
    problem = seen.during(name).facts[PROBLEM]
    return 'the reset failed: ' + problem if problem else ''


def resets(seen: Observation) -> str:
    """Does a service declare where the robot is?"""
    return _reset(seen, RESET_TO_ORIGIN)


def says_reset(seen: Observation) -> str:
    """Is the line of the reset printed?"""
    return '' if SET.search(seen.during(RESET_TO_ORIGIN).printed) else \
        'no line "Local pose set to x=..., y=..., yaw=..." was printed'


def second_place(seen: Observation) -> str:
    """Is the same task done again, from another place and heading?"""
    return resets(seen) or drives.place(seen, SECOND_DRIVE)


def second_heading(seen: Observation) -> str:
    """Does the robot face the goal's heading again?"""
    return resets(seen) or drives.heading(seen, SECOND_DRIVE)


def control_taken(seen: Observation) -> str:
    """Does it stop the robot when control is taken?"""
    scene = seen.during(CONTROL_TAKEN)
    if not scene.facts[WAS_MOVING]:
        return 'it got control, but did not move the robot, so that a stop could not be seen'
    if len(scene.moving_after(AT_ONCE)):
        return 'it drove on for more than {:g} s after control had been taken'.format(AT_ONCE)
    if not len(scene.commands) or scene.commands[-1, 1:].any():
        return 'it sent no zero velocity when control was taken'
    return ''


def exact(seen: Observation) -> str:
    """Are both drives several times as exact as the handout asks for?"""
    return first_missed(*(said for name in (FIRST_DRIVE, SECOND_DRIVE) for said in (
        drives.place(seen, name, drives.EXACT_DISTANCE),
        drives.heading(seen, name, drives.EXACT_ANGLE))))


def offset_imu(seen: Observation) -> str:
    """Does it drive with an IMU whose zero is not that of the odometry?"""
    return drives.place(seen, OFFSET_DRIVE) or drives.heading(seen, OFFSET_DRIVE)


def declared_pose(seen: Observation) -> str:
    """Does it drive from a declared pose that is not the origin?"""
    return _reset(seen, RESET_ELSEWHERE) or drives.place(seen, DECLARED_DRIVE) or drives.heading(
        seen, DECLARED_DRIVE)


def lost_odometry(seen: Observation) -> str:
    """Does silent odometry stop the drive?"""
    return stops_when_silent(seen, ODOMETRY_SILENT, 'the odometry')


CRITERIA = [
    Criterion('starts', DRIVE, 'runs and listens to odom', STATES, starts, limits=IN_TIME),
    Criterion('waits', DRIVE, 'does not move before it has control', STATES, waits,
              limits='for {:g} s'.format(WATCHED)),
    Criterion('goal_place', DRIVE, 'drives to ({:g}, {:g})'.format(*drives.GOAL), THEORY,
              goal_place, limits=drives.PLACE_LIMITS),
    Criterion('goal_heading', DRIVE, 'faces 0 degrees there', THEORY, goal_heading,
              limits=drives.HEADING_LIMITS),
    Criterion('says_reached', DRIVE, 'says "Goal reached!" once', STATES, says_reached),
    Criterion('silent_at_goal', DRIVE, 'sends nothing on cmd_vel at the goal', STATES,
              silent_at_goal, limits='from {:g} s after its arrival on'.format(LAST_WORD)),
    Criterion('within_limits', DRIVE, "keeps the robot's limits, {:g} m/s and {:g} rad/s".format(
        FASTEST, FASTEST_TURN), THEORY, within_limits,
              limits='and {:g} for rounding'.format(ROUNDING)),
    Criterion('resets', RESET, 'a service resets the local frame', AT_RESET, resets,
              limits='answers within {:g} s'.format(ANSWER_TIME)),
    Criterion('says_reset', RESET, 'says "Local pose set to x=..., y=..., yaw=..."', AT_RESET,
              says_reset, limits='within {:g} s after the answer'.format(TAKES_EFFECT)),
    Criterion('second_place', RESET, 'does the same task after a turn by {:g} degrees and a '
              'reset'.format(TURNED), DEMONSTRATION, second_place, limits='as goal_place'),
    Criterion('second_heading', RESET, 'faces 0 degrees of the new frame', DEMONSTRATION,
              second_heading, limits='as goal_heading'),
    Criterion('control_taken', CONTROL, 'stops the robot at once when control is taken', STATES,
              control_taken, limits='zero velocity ' + STOPS_AT_ONCE),
    Criterion('clean_exit', CONTROL, CLEAN_EXIT, STATES, clean_exit,
              limits=CLEAN_EXIT_LIMITS),
    Criterion('stops_robot', CONTROL, 'at Ctrl+C in a drive sends zero velocity', STATES,
              stops_robot, extra=True, limits=STOPS_IN_TIME),
    Criterion('exact', RESET, 'both drives are within {:g} m and {:g} degree'.format(
        drives.EXACT_DISTANCE, drives.EXACT_ANGLE), ANALYSIS, exact, extra=True),
    Criterion('declared_pose', DECLARED, 'drives from a declared pose that is not the origin',
              AT_RESET, declared_pose, extra=True, limits='as goal_place and goal_heading'),
    Criterion('offset_imu', OFFSET, 'drives with an IMU whose zero is not that of the odometry',
              TWO_ZEROS, offset_imu, extra=True, limits='as goal_place and goal_heading'),
    Criterion('lost_odometry', LOST, 'stops the robot after the odometry fell silent', STATES,
              lost_odometry, extra=True, limits=STOPS_WHEN_LOST),
]
