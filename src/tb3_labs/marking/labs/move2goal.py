"""The criteria of the Transformation lab, in which a node drives to a goal in a local frame, and
resets this frame."""
import math
import re
from functools import partial

import numpy as np

from tb3_labs.geometry.angles import difference, wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.handout import (
    ANGLE_TOLERANCE, CTRL_RELINQ_TOPIC, DISTANCE_TOLERANCE, GOAL_X, GOAL_Y, GOAL_YAW_DEG,
    MAX_ANGULAR_SPEED, MAX_LINEAR_SPEED, PRINTED_POSE_SET, PRINTED_REACHED, SET_POSE_SERVICE)
from tb3_labs.marking.labs.criteria import (
    ANGULAR, EXTRAS, LINEAR, NO_ZERO_VELOCITY, ROUNDING, START_LIMITS, STOP_LIMITS, Criterion,
    Reason, clean_exit_criterion, ends_in_motion, lost_device_criterion, why_not_started,
    why_not_stopped, why_not_stopped_at_ctrl_c, within)
from tb3_labs.marking.labs.stimuli import (
    AT_GOAL, CONTROL, CONTROL_TAKEN, DECLARED, DECLARED_DRIVE, DRIVE, DRIVE_REACTION_TIME,
    DROVE_STRAIGHT, FIRST_DRIVE, MAX_DRIVE_DISTANCE, MAX_DRIVE_TIME, OBSERVATION_TIME,
    ODOMETRY_SILENT, OFFSET, OFFSET_DRIVE, PRINT_AFTER_RESET_TIME, RESET, RESET_ELSEWHERE,
    RESET_IN_DRIVE, RESET_PROBLEM, RESET_REPLY_TIME, RESET_TO_ORIGIN, SECOND_DRIVE,
    TURN_BEFORE_RESET_DEG, TURN_TIME_IN_DRIVE, WITHOUT_CONTROL, WRONG_NAME)
from tb3_labs.marking.trial.observation import (
    GOAL_POSE, LOCAL_T_WORLD, MOVED, RESTED, WAS_MOVING, NotObserved, Observation, Scene)
from tb3_labs.marking.trial.remarks import why_idle
from tb3_labs.watch.lab_links import (
    STATES_SECTION, LOCAL_POSE_SECTION, RESET_SECTION, TRANSFORMATION_SHEET, SheetStep)

MAX_COMMAND_TIME_AT_GOAL = 0.5      # [s] after the arrival
MIN_TURN_IN_DRIVE_DEG = 20.0        # of a correct node after a reset in a drive
TOLERANCE_DEG = math.degrees(ANGLE_TOLERANCE)
#: The robot may coast by this distance [m] and this angle after a stop command.
COAST_DISTANCE, COAST_DEG = 0.02, 2.0
#: The tolerances of the criterion `exact`, which is beyond the handout. The distance is in [m].
EXACT_DISTANCE, EXACT_DEG = 0.02, 1.0
FACES_GOAL = f'faces {GOAL_YAW_DEG:g} degrees'
PLACE_LIMITS = f'within {DISTANCE_TOLERANCE:g} m, and {COAST_DISTANCE:g} for stopping; begun ' \
    f'{within(DRIVE_REACTION_TIME)}, over {within(MAX_DRIVE_TIME)}, never ' \
    f'{MAX_DRIVE_DISTANCE:g} m away'
HEADING_LIMITS = f'within {ANGLE_TOLERANCE:g} rad ({TOLERANCE_DEG:.1f} degrees), and ' \
    f'{COAST_DEG:g} degrees for stopping'

ANALYSIS_STEP = SheetStep(TRANSFORMATION_SHEET, '6. Analysis')
SECOND_DRIVE_STEP = RESET_SECTION.at_step(2)
TWO_ZEROS_STEP = LOCAL_POSE_SECTION.at_step(4)


def _why_not_at_place(observation: Observation, name: str,
                      tolerance: float = DISTANCE_TOLERANCE + COAST_DISTANCE) -> Reason:
    scene = _scene_of_drive(observation, name)
    distance = _final_pose(scene).distance_to(Pose2(*scene.facts[GOAL_POSE]))
    if not scene.facts[RESTED]:
        return f'{_exceeded_limit(scene)}, {distance:.2f} m from the goal'
    return '' if distance <= tolerance else f'it stopped {distance:.2f} m from the goal'


def _why_not_at_heading(observation: Observation, name: str,
                        tolerance: float = TOLERANCE_DEG + COAST_DEG) -> Reason:
    scene = _scene_of_drive(observation, name)
    if not scene.facts[RESTED]:
        return _exceeded_limit(scene)
    yaw, goal_yaw = wrap(_final_pose(scene).yaw), wrap(scene.facts[GOAL_POSE][2])
    if abs(math.degrees(difference(yaw, goal_yaw))) <= tolerance:
        return ''
    return (f'at the end it faced {math.degrees(yaw):.1f} degrees instead of '
            f'{math.degrees(goal_yaw):.0f}')


def _exceeded_limit(scene: Scene) -> str:
    _, dx, dy, _ = scene.truth[-1] - scene.truth[0]
    distance = math.hypot(dx, dy)
    limit = 'the limit'
    if distance > MAX_DRIVE_DISTANCE:
        limit = f'more than {MAX_DRIVE_DISTANCE:g} m from its start'
    return f'it was still moving after {scene.end - scene.begin:.0f} s, {limit}'


def _scene_of_drive(observation: Observation, name: str) -> Scene:
    """Returns the Scene of a drive. Raises ``NotObserved`` if the node did not move the robot."""
    scene = observation.scene(name)
    if not scene.facts[MOVED]:
        subscribed = scene.process.subscribed
        why = why_idle(scene)
        if subscribed and '/' + CTRL_RELINQ_TOPIC not in subscribed:
            why = f'it does not listen to {CTRL_RELINQ_TOPIC}'
        raise NotObserved(f'it got control, but did not move the robot: {why}')
    return scene


def _final_pose(scene: Scene) -> Pose2:
    """Returns the pose at the end of a drive, in the local frame."""
    return Pose2(*scene.facts[LOCAL_T_WORLD]) @ Pose2(*scene.truth[-1, 1:])


def _why_not_printed_once(observation: Observation) -> Reason:
    printed = observation.scene(FIRST_DRIVE).printed + observation.scene(AT_GOAL).printed
    count = len(re.findall(PRINTED_REACHED, printed, re.IGNORECASE))
    return '' if count == 1 else f'"{PRINTED_REACHED}!" was printed {count} times'


def _why_not_silent_at_goal(observation: Observation) -> Reason:
    drive = _scene_of_drive(observation, FIRST_DRIVE)
    if not drive.facts[RESTED]:
        return 'it never arrived'
    if ends_in_motion(drive.commands):
        return NO_ZERO_VELOCITY.format('its arrival')
    _, late = observation.scene(AT_GOAL).commands_before_and_after(MAX_COMMAND_TIME_AT_GOAL)
    return 'it went on sending commands on cmd_vel after it had arrived' if len(late) else ''


def _why_not_within_limits(observation: Observation) -> Reason:
    commands = np.vstack([
        drive.commands for drive in observation.scenes((FIRST_DRIVE, SECOND_DRIVE))])
    if not len(commands):
        return 'it commanded nothing'
    linear, angular = np.abs(commands[:, 1:]).max(axis=0)
    is_slow = linear <= MAX_LINEAR_SPEED + ROUNDING
    observation.set_moment_of_fastest(commands, ANGULAR if is_slow else LINEAR)
    if is_slow and angular <= MAX_ANGULAR_SPEED + ROUNDING:
        return ''
    return f'it commanded up to {linear:.2f} m/s and {angular:.1f} rad/s'


def _why_reset_failed(observation: Observation, name: str = RESET_TO_ORIGIN) -> Reason:
    problem = observation.scene(name).facts[RESET_PROBLEM]
    if not problem:
        return ''
    advice = ' (does its callback return a response?)' if 'returned None' in problem else ''
    return f'the reset failed: {problem}{advice}'


def _why_not_reset(observation: Observation) -> Reason:
    wrong_name = observation.scene(RESET_TO_ORIGIN).facts[WRONG_NAME]
    reason = _why_reset_failed(observation)
    if reason:
        return reason
    if wrong_name:
        return f'its reset is called {wrong_name}, not /{SET_POSE_SERVICE}'
    scene = observation.scene(RESET_IN_DRIVE)
    reason = _why_reset_failed(observation, RESET_IN_DRIVE)
    if not scene.facts[WAS_MOVING]:
        return reason
    if not scene.facts[DROVE_STRAIGHT]:
        return 'turned to its goal by hand after a reset, it did not drive straight there'
    has_turned = abs(scene.turned_deg) >= MIN_TURN_IN_DRIVE_DEG
    if reason or has_turned:
        return reason
    return ('after a reset in the middle of a drive it did not turn to the goal of the new frame, '
            f'but by {scene.turned_deg:.0f} degrees in {TURN_TIME_IN_DRIVE:g} s')


def _why_not_waited(observation: Observation) -> Reason:
    """Judges whether the robot rested while the node had no control: after the start of the node,
    and during a reset."""
    has_moved = len(observation.scene(WITHOUT_CONTROL).moving_commands) > 0
    if not has_moved and observation.has(RESET_TO_ORIGIN):
        scene = observation.scene(RESET_TO_ORIGIN, may_die=True)
        has_moved = len(scene.moving_commands) > 0 and not scene.facts.get(WAS_MOVING)
    if not has_moved:
        return ''
    return ('it moved the robot without having control: does control_loop look at has_control, '
            'which True on ctrl_relinq sets and False clears?')


def _why_control_kept(observation: Observation) -> Reason:
    scene = observation.scene(CONTROL_TAKEN)
    if not scene.facts[WAS_MOVING]:
        return 'it did not move the robot, so that a stop could not be seen'
    return why_not_stopped(scene, 'control was taken')


def _why_not_exact(observation: Observation) -> Reason:
    names = [FIRST_DRIVE, SECOND_DRIVE] if DRIVE in dict(observation.parts) else [SECOND_DRIVE]
    for name in names:
        reason = (_why_not_at_place(observation, name, EXACT_DISTANCE)
                  or _why_not_at_heading(observation, name, EXACT_DEG))
        if reason:
            return reason
    return ''


def _why_not_arrived(observation: Observation, name: str) -> Reason:
    return _why_not_at_place(observation, name) or _why_not_at_heading(observation, name)


def _why_no_reset_printed(observation: Observation) -> Reason:
    printed = observation.scene(RESET_TO_ORIGIN).printed
    if PRINTED_POSE_SET.lower() in printed.lower():
        return ''
    return f'no line "{PRINTED_POSE_SET} to x=..., y=..., yaw=..." was printed'


CRITERIA = [
    Criterion('starts', DRIVE, 'runs and listens to odom', STATES_SECTION, why_not_started,
              limits=START_LIMITS),
    Criterion('waits', DRIVE, 'does not move before it has control', STATES_SECTION,
              _why_not_waited, limits=f'for {OBSERVATION_TIME:g} s, and after a reset'),
    Criterion('goal_place', DRIVE, f'drives to ({GOAL_X:g}, {GOAL_Y:g})', STATES_SECTION,
              partial(_why_not_at_place, name=FIRST_DRIVE), limits=PLACE_LIMITS),
    Criterion('goal_heading', DRIVE, FACES_GOAL + ' there', STATES_SECTION,
              partial(_why_not_at_heading, name=FIRST_DRIVE), limits=HEADING_LIMITS),
    Criterion('says_reached', DRIVE, f'says "{PRINTED_REACHED}!" once', STATES_SECTION,
              _why_not_printed_once),
    Criterion('silent_at_goal', DRIVE, 'sends nothing on cmd_vel at the goal', STATES_SECTION,
              _why_not_silent_at_goal, limits='a zero velocity, then nothing from '
              f'{MAX_COMMAND_TIME_AT_GOAL:g} s after its arrival on'),
    Criterion('within_limits', DRIVE, f"keeps the robot's limits, {MAX_LINEAR_SPEED:g} m/s and "
              f'{MAX_ANGULAR_SPEED:g} rad/s', STATES_SECTION, _why_not_within_limits,
              limits=f'and {ROUNDING:g} for rounding'),
    Criterion('resets', RESET, f'a service /{SET_POSE_SERVICE} resets the local frame, also in '
              'a drive', RESET_SECTION, _why_not_reset,
              limits=f'answers {within(RESET_REPLY_TIME)}; in a drive it '
              f'turns by {MIN_TURN_IN_DRIVE_DEG:g} degrees {within(TURN_TIME_IN_DRIVE)}'),
    Criterion('says_reset', RESET, f'says "{PRINTED_POSE_SET} to x=..., y=..., yaw=..."',
              RESET_SECTION, _why_no_reset_printed,
              limits=within(PRINT_AFTER_RESET_TIME) + ' after the answer'),
    Criterion('second_place', RESET, 'does the same task after a turn by '
              f'{TURN_BEFORE_RESET_DEG:g} degrees and a reset', SECOND_DRIVE_STEP,
              lambda observation: (
                  _why_reset_failed(observation) or _why_not_at_place(observation, SECOND_DRIVE)),
              limits='as goal_place'),
    Criterion('second_heading', RESET, FACES_GOAL + ' of the new frame', SECOND_DRIVE_STEP,
              lambda observation: (
                  _why_reset_failed(observation) or _why_not_at_heading(observation, SECOND_DRIVE)),
              limits='as goal_heading'),
    Criterion('control_taken', CONTROL, 'stops the robot at once when control is taken',
              STATES_SECTION, _why_control_kept, limits='zero velocity ' + STOP_LIMITS),
    clean_exit_criterion(CONTROL, STATES_SECTION),
    Criterion('stops_robot', CONTROL, 'at Ctrl+C in a drive sends zero velocity', EXTRAS,
              why_not_stopped_at_ctrl_c, extra=True, limits=STOP_LIMITS),
    Criterion('exact', RESET, f'both drives are within {EXACT_DISTANCE:g} m and '
              f'{EXACT_DEG:g} degree', ANALYSIS_STEP, _why_not_exact, extra=True),
    Criterion('declared_pose', DECLARED, 'drives from a declared pose that is not the origin',
              EXTRAS, lambda observation: (_why_reset_failed(observation, RESET_ELSEWHERE)
                                           or _why_not_arrived(observation, DECLARED_DRIVE)),
              extra=True, limits='as goal_place and goal_heading'),
    Criterion('offset_imu', OFFSET, 'drives although the zeros of IMU and odometry differ',
              TWO_ZEROS_STEP, partial(_why_not_arrived, name=OFFSET_DRIVE), extra=True,
              limits='as goal_place and goal_heading'),
    lost_device_criterion('lost_odometry', 'stops the robot', 'the odometry', ODOMETRY_SILENT,
                          EXTRAS),
]
