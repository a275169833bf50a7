"""The stimuli and the criteria of the Transformation lab: drives to a goal in a local frame, and
the reset of this frame."""
import math
import re
from functools import partial
from typing import List, Sequence

import numpy as np

from tb3_labs.geometry.angles import difference, wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.handout import (
    ANGLE_TOLERANCE, CTRL_RELINQ, DISTANCE_TOLERANCE, GOAL_X, GOAL_Y, GOAL_YAW_DEG,
    MAX_ANGULAR_SPEED, MAX_LINEAR_SPEED, PRINTED_POSE_SET, PRINTED_REACHED, SET_POSE)
from tb3_labs.marking.labs.criteria import (
    ANGULAR, BEYOND, IN_TIME, LINEAR, NO_ZERO, ROUNDING, STOPS_AT_ONCE, Criterion, Reason,
    ends_cleanly, not_stopped, starts, stops_robot, stops_when_lost)
from tb3_labs.marking.trial.observation import (
    GOAL_POSE, LOCAL_T_WORLD, MOVED, RESTED, WAS_MOVING, NotObserved, Observation, Scene)
from tb3_labs.marking.trial.remarks import why_idle
from tb3_labs.watch.chains import (
    FOUR_STATES, THE_LOCAL_POSE, THE_RESET, TRANSFORMATION_SHEET, Place)

#: The parts of the lab.
DRIVE, RESET, CONTROL, DECLARED, OFFSET = 'drive', 'reset', 'control', 'declared', 'offset'
#: The stimuli of each part.
WITHOUT_CONTROL, FIRST_DRIVE, AT_GOAL = 'without control', 'first drive', 'at the goal'
RESET_TO_ORIGIN, SECOND_DRIVE = 'reset to the origin', 'second drive'
RESET_IN_DRIVE = 'reset in a drive'
CONTROL_TAKEN = 'control taken'
RESET_ELSEWHERE, DECLARED_DRIVE = 'reset to another pose', 'drive from a declared pose'
OFFSET_DRIVE = 'drive with an offset IMU'
ODOMETRY_SILENT = 'odometry silent'
#: Keys of a reset's facts. PROBLEM: the reason why the reset failed, '' if it succeeded. NAME: the
#: name of the service, '' if it is SET_POSE, which the sheet and the gamepad call. STRAIGHT: did
#: the node drive forward before the reset? The marker had turned the robot to its goal.
PROBLEM, NAME, STRAIGHT = 'problem', 'name', 'straight'

#: The node is observed for this time before it has control, and at the goal [s].
WATCHED = 1.5
#: The node must send no command from this time after its arrival on [s].
LAST_COMMAND = 0.5
#: A reset answers within ANSWER_TIME [s]. Its line is printed within TAKES_EFFECT [s] after the
#: answer.
ANSWER_TIME, TAKES_EFFECT = 3.0, 0.5
#: The marker turns the robot by this angle before the reset [deg].
TURNED = 100.0
#: At a reset in a drive the robot faces its goal. Within IN_DRIVE [s] the node then turns by more
#: than LEAST_TURN [deg], to the goal of the new frame.
IN_DRIVE, LEAST_TURN = 3.0, 20.0
REACHED = re.compile(PRINTED_REACHED, re.IGNORECASE)

#: The goal as a fact of a drive: x, y [m], heading [rad].
GOAL = (GOAL_X, GOAL_Y, math.radians(GOAL_YAW_DEG))
ANGLE = math.degrees(ANGLE_TOLERANCE)
#: A stopped robot may coast by this [m], [deg].
MORE_DISTANCE, MORE_ANGLE = 0.02, 2.0
#: The tolerances of the criterion beyond the handout [m], [deg].
EXACT_DISTANCE, EXACT_ANGLE = 0.02, 1.0
#: A drive begins within REACTION [s] after control was given, and takes at most DRIVE_TIME [s].
REACTION, DRIVE_TIME = 4.0, 50.0
#: A drive goes at most this far from its start [m].
ASTRAY = 3.0
#: The goal's heading, and the limits of place and heading, in words.
FACES = f'faces {GOAL_YAW_DEG:g} degrees'
PLACE_LIMITS = 'within {:g} m, and {:g} for stopping; begun within {:g} s, over within {:g} s, ' \
    'never {:g} m away'.format(
        DISTANCE_TOLERANCE, MORE_DISTANCE, REACTION, DRIVE_TIME, ASTRAY)
HEADING_LIMITS = 'within {:g} rad ({:.1f} degrees), and {:g} degrees for stopping'.format(
    ANGLE_TOLERANCE, ANGLE, MORE_ANGLE)

ANALYSIS = Place(TRANSFORMATION_SHEET, '6. Analysis')
#: The step that names the mistakes of a drive after a reset.
TURNED_STEP = THE_RESET.at_step(2)
TWO_ZEROS = THE_LOCAL_POSE.at_step(4)


def _place(observation: Observation, name: str,
           tolerance: float = DISTANCE_TOLERANCE + MORE_DISTANCE) -> Reason:
    """Judges whether the drive `name` ended at most `tolerance` [m] from the goal."""
    scene = _driven(observation, name)
    away = _end_of(scene).distance_to(Pose2(*scene.facts[GOAL_POSE]))
    if not scene.facts[RESTED]:
        return f'{_unended(scene)}, {away:.2f} m from the goal'
    return '' if away <= tolerance else f'it stopped {away:.2f} m from the goal'


def _heading(observation: Observation, name: str, tolerance: float = ANGLE + MORE_ANGLE) -> Reason:
    """Judges whether the drive `name` ended at most `tolerance` [deg] from the goal's heading."""
    scene = _driven(observation, name)
    if not scene.facts[RESTED]:
        return _unended(scene)
    faced, goal = wrap(_end_of(scene).yaw), wrap(scene.facts[GOAL_POSE][2])
    return '' if abs(math.degrees(difference(faced, goal))) <= tolerance else \
        f'at the end it faced {math.degrees(faced):.1f} degrees instead of {math.degrees(goal):.0f}'


def _unended(scene: Scene) -> str:
    """Returns a clause on the limit of time or distance that ended a drive."""
    astray = np.hypot(*(scene.truth[-1] - scene.truth[0])[1:3]) > ASTRAY
    return 'it was still moving after {:.0f} s, {}'.format(scene.end - scene.begin, (
        'more than {:g} m from its start'.format(ASTRAY) if astray else 'the limit'))


def _driven(observation: Observation, name: str) -> Scene:
    """Returns the Scene of a drive; NotObserved if the node did not move the robot."""
    scene = observation.scene(name)
    if not scene.facts[MOVED]:
        hears = '/' + CTRL_RELINQ in scene.run.listens or not scene.run.listens
        raise NotObserved('it got control, but did not move the robot: {}'.format(
            why_idle(scene) if hears else 'it does not listen to {}'.format(CTRL_RELINQ)))
    return scene


def _end_of(scene: Scene) -> Pose2:
    """Returns the pose at the end of a drive, in the local frame."""
    return Pose2(*scene.facts[LOCAL_T_WORLD]) @ Pose2(*scene.truth[-1, 1:])


def _says_reached(observation: Observation) -> Reason:
    number = len(REACHED.findall(observation.scene(FIRST_DRIVE).printed
                                 + observation.scene(AT_GOAL).printed))
    return '' if number == 1 else f'"{PRINTED_REACHED}!" was printed {number} times'


def _silent_at_goal(observation: Observation) -> Reason:
    drive = _driven(observation, FIRST_DRIVE)
    if not drive.facts[RESTED]:
        return 'it never arrived'
    if drive.commands[-1, 1:].any():
        return NO_ZERO.format('its arrival')
    _, late = observation.scene(AT_GOAL).split(LAST_COMMAND)
    return 'it went on sending commands on cmd_vel after it had arrived' if len(late) else ''


def _within_limits(observation: Observation) -> Reason:
    commands = np.vstack([
        drive.commands for drive in observation.scenes((FIRST_DRIVE, SECOND_DRIVE))])
    if not len(commands):
        return 'it commanded nothing'
    turn, forward = observation.greatest_speed(commands, ANGULAR), np.abs(commands[:, LINEAR]).max()
    if forward > MAX_LINEAR_SPEED + ROUNDING:
        observation.greatest_speed(commands, LINEAR)
    is_slow = forward <= MAX_LINEAR_SPEED + ROUNDING and turn <= MAX_ANGULAR_SPEED + ROUNDING
    return '' if is_slow else \
        f'it commanded up to {forward:.2f} m/s and {turn:.1f} rad/s'


def _reset(observation: Observation, name: str = RESET_TO_ORIGIN) -> Reason:
    problem = observation.scene(name).facts[PROBLEM]
    if 'returned None' in problem:
        problem += ' (does its callback return a response?)'
    return problem and 'the reset failed: ' + problem


def _resets(observation: Observation) -> Reason:
    """Judges the name of the reset, and its effect at rest and in a drive."""
    name = observation.scene(RESET_TO_ORIGIN).facts[NAME]
    if _reset(observation) or name:
        return _reset(observation) or f'its reset is called {name}, not /{SET_POSE}'
    scene = observation.scene(RESET_IN_DRIVE)
    if scene.facts[WAS_MOVING] and not scene.facts[STRAIGHT]:
        return 'turned to its goal by hand after a reset, it did not drive straight there'
    return _reset(observation, RESET_IN_DRIVE) or (
        'after a reset in the middle of a drive it did not turn to the goal of the new frame, but '
        f'by {scene.turned_deg:.0f} degrees in {IN_DRIVE:g} s'
        if scene.facts[WAS_MOVING] and abs(scene.turned_deg) < LEAST_TURN else '')


def _waits(observation: Observation) -> Reason:
    scenes = (observation.scene(name, may_die=name == RESET_TO_ORIGIN) for name in (
        WITHOUT_CONTROL, RESET_TO_ORIGIN) if name == WITHOUT_CONTROL or observation.has(name))
    return 'it moved the robot without having control: does control_loop look at has_control, ' \
        'which True on ctrl_relinq sets and False clears?' if any(
            len(scene.moving) and not scene.facts.get(WAS_MOVING) for scene in scenes) else ''


def _control_taken(observation: Observation) -> Reason:
    scene = observation.scene(CONTROL_TAKEN)
    if not scene.facts[WAS_MOVING]:
        return 'it did not move the robot, so that a stop could not be seen'
    return not_stopped(scene, 'control was taken')


def _exact(observation: Observation, name: str) -> Reason:
    return _place(observation, name, EXACT_DISTANCE) or _heading(observation, name, EXACT_ANGLE)


def _arrives(observation: Observation, name: str) -> Reason:
    return _place(observation, name) or _heading(observation, name)


def remarks_on_parts(observation: Observation, parts: Sequence[str]) -> List[str]:
    """Returns a sentence if the part OFFSET was not tried, and [] otherwise: in the other parts a
    node is right that takes the yaw of the IMU for that of the odometry."""
    return [] if not parts or OFFSET in parts else [
        'Odometry and IMU had the same zero here, a real robot has two: add offset to the parts; '
        'see {}.'.format(TWO_ZEROS)]


CRITERIA = [
    Criterion('starts', DRIVE, 'runs and listens to odom', FOUR_STATES, starts, limits=IN_TIME),
    Criterion('waits', DRIVE, 'does not move before it has control', FOUR_STATES,
              _waits, limits=f'for {WATCHED:g} s, and after a reset'),
    Criterion('goal_place', DRIVE, f'drives to ({GOAL_X:g}, {GOAL_Y:g})', FOUR_STATES,
              partial(_place, name=FIRST_DRIVE), limits=PLACE_LIMITS),
    Criterion('goal_heading', DRIVE, FACES + ' there', FOUR_STATES,
              partial(_heading, name=FIRST_DRIVE), limits=HEADING_LIMITS),
    Criterion('says_reached', DRIVE, f'says "{PRINTED_REACHED}!" once', FOUR_STATES, _says_reached),
    Criterion('silent_at_goal', DRIVE, 'sends nothing on cmd_vel at the goal', FOUR_STATES,
              _silent_at_goal, limits='a zero velocity, then nothing from {:g} s after its '
              'arrival on'.format(LAST_COMMAND)),
    Criterion('within_limits', DRIVE, "keeps the robot's limits, {:g} m/s and {:g} rad/s".format(
        MAX_LINEAR_SPEED, MAX_ANGULAR_SPEED), FOUR_STATES, _within_limits,
              limits=f'and {ROUNDING:g} for rounding'),
    Criterion('resets', RESET, 'a service /{} resets the local frame, also in a drive'.format(
        SET_POSE), THE_RESET, _resets, limits='answers within {:g} s; in a drive it turns by {:g} '
              'degrees within {:g} s'.format(ANSWER_TIME, LEAST_TURN, IN_DRIVE)),
    Criterion('says_reset', RESET, f'says "{PRINTED_POSE_SET} to x=..., y=..., yaw=..."',
              THE_RESET, lambda observation: '' if PRINTED_POSE_SET.lower() in observation.scene(
                  RESET_TO_ORIGIN).printed.lower() else
              f'no line "{PRINTED_POSE_SET} to x=..., y=..., yaw=..." was printed',
              limits=f'within {TAKES_EFFECT:g} s after the answer'),
    Criterion('second_place', RESET, 'does the same task after a turn by {:g} degrees and a '
              'reset'.format(TURNED), TURNED_STEP,
              lambda observation: _reset(observation) or _place(observation, SECOND_DRIVE),
              limits='as goal_place'),
    Criterion('second_heading', RESET, FACES + ' of the new frame', TURNED_STEP,
              lambda observation: _reset(observation) or _heading(observation, SECOND_DRIVE),
              limits='as goal_heading'),
    Criterion('control_taken', CONTROL, 'stops the robot at once when control is taken',
              FOUR_STATES, _control_taken, limits='zero velocity ' + STOPS_AT_ONCE),
    ends_cleanly(CONTROL, FOUR_STATES),
    Criterion('stops_robot', CONTROL, 'at Ctrl+C in a drive sends zero velocity', BEYOND,
              stops_robot, extra=True, limits=STOPS_AT_ONCE),
    Criterion('exact', RESET, 'both drives are within {:g} m and {:g} degree'.format(
        EXACT_DISTANCE, EXACT_ANGLE), ANALYSIS,
              lambda observation: _exact(observation, FIRST_DRIVE)
              or _exact(observation, SECOND_DRIVE),
              extra=True, also=DRIVE),
    Criterion('declared_pose', DECLARED, 'drives from a declared pose that is not the origin',
              BEYOND, lambda observation: _reset(observation, RESET_ELSEWHERE)
              or _arrives(observation, DECLARED_DRIVE),
              extra=True, limits='as goal_place and goal_heading'),
    Criterion('offset_imu', OFFSET, 'drives with an IMU whose zero is not that of the odometry',
              TWO_ZEROS, partial(_arrives, name=OFFSET_DRIVE), extra=True,
              limits='as goal_place and goal_heading'),
    stops_when_lost('lost_odometry', 'stops the robot', 'the odometry', ODOMETRY_SILENT, BEYOND),
]
