"""The criteria of the Transformation lab, in which a node drives to a goal in a local frame and
resets this frame."""
import math
import re
from functools import partial

import numpy as np

from tb3_labs.geometry.angles import difference, wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.handout import (
    ANGLE_TOLERANCE, CTRL_RELINQ_TOPIC, DISTANCE_TOLERANCE, GAIN_TO_GOAL, GOAL_X, GOAL_Y,
    GOAL_YAW_DEG, MAX_ANGULAR_SPEED, MAX_LINEAR_SPEED, PRINTED_POSE_SET, PRINTED_REACHED,
    SET_POSE_SERVICE)
from tb3_labs.marking.labs import stimuli
from tb3_labs.marking.labs.criteria import (
    EXTRAS, NO_ZERO_VELOCITY, ROUNDING_TOLERANCE, START_LIMITS, STOP_LIMITS, Criterion, Reason,
    clean_exit_criterion, ends_in_motion, judge_start, judge_stop, judge_stop_at_ctrl_c,
    lost_device_criterion, within)
from tb3_labs.marking.trial.observation import (
    ANGULAR, GOAL_POSE, LINEAR, LOCAL_T_WORLD, MOVED, RESTED, WAS_MOVING, NotObserved, Observation,
    Scene)
from tb3_labs.marking.trial.remarks import why_idle
from tb3_labs.watch.lab_mistakes import (
    LOCAL_POSE_SECTION, RESET_SECTION, STATES_SECTION, TRANSFORMATION_SHEET)
from tb3_labs.watch.mistake import SheetStep

LAST_COMMAND_TIME = 0.5     # A node may send commands until this time [s] after its arrival.
#: After a reset in the middle of a drive, a correct node turns to the goal. By the handout's law it
#: reaches this share of the goal's bearing. A quarter of this turn is enough.
TURN_SHARE = 1.0 - math.exp(-GAIN_TO_GOAL * stimuli.TURN_TIME_IN_DRIVE)
MIN_TURN_IN_DRIVE_DEG = round(0.25 * TURN_SHARE * abs(stimuli.GOAL_BEARING_DEG))
TOLERANCE_DEG = math.degrees(ANGLE_TOLERANCE)
#: After a stop command, the robot moves further by at most this distance [m] and this angle.
COAST_DISTANCE, COAST_DEG = 0.02, 2.0
EXACT_DISTANCE = 0.02               # [m], in the criterion `exact`
EXACT_DEG = 1.0                     # in the criterion `exact`
FACES_GOAL = f'faces {GOAL_YAW_DEG:g} degrees'
PLACE_LIMITS = (
    f'within {DISTANCE_TOLERANCE:g} m, and {COAST_DISTANCE:g} for stopping; begun '
    f'{within(stimuli.DRIVE_REACTION_TIME)}, over {within(stimuli.MAX_DRIVE_TIME)}, never '
    f'{stimuli.MAX_DRIVE_DISTANCE:g} m away')
HEADING_LIMITS = (
    f'within {ANGLE_TOLERANCE:g} rad ({TOLERANCE_DEG:.1f} degrees), and {COAST_DEG:g} degrees for '
    'stopping')
SECOND_DRIVE_STEP = RESET_SECTION.at_step(2)


def _judge_goal_place(observation: Observation, name: str,
                      tolerance: float = DISTANCE_TOLERANCE + COAST_DISTANCE) -> Reason:
    scene = _enter_drive(observation, name)
    distance = _final_pose(scene).distance_to(Pose2(*scene.facts[GOAL_POSE]))
    if not scene.facts[RESTED]:
        return f'{_clause_on_exceeded_limit(scene)}, {distance:.2f} m from the goal'
    return '' if distance <= tolerance else f'it stopped {distance:.2f} m from the goal'


def _judge_goal_heading(observation: Observation, name: str,
                        tolerance: float = TOLERANCE_DEG + COAST_DEG) -> Reason:
    scene = _enter_drive(observation, name)
    if not scene.facts[RESTED]:
        return _clause_on_exceeded_limit(scene)
    yaw = wrap(_final_pose(scene).yaw)
    goal_yaw = wrap(Pose2(*scene.facts[GOAL_POSE]).yaw)
    if abs(math.degrees(difference(yaw, goal_yaw))) <= tolerance:
        return ''
    return (f'at the end it faced {math.degrees(yaw):.1f} degrees instead of '
            f'{math.degrees(goal_yaw):.0f}')


def _clause_on_exceeded_limit(scene: Scene) -> str:
    _, dx, dy, _ = scene.truth[-1] - scene.truth[0]
    is_astray = math.hypot(dx, dy) > stimuli.MAX_DRIVE_DISTANCE
    limit = (f'more than {stimuli.MAX_DRIVE_DISTANCE:g} m from its start' if is_astray
             else 'the limit')
    return f'it was still moving after {scene.end - scene.begin:.0f} s, {limit}'


def _enter_drive(observation: Observation, name: str) -> Scene:
    """Returns the Scene of a drive. Raises ``NotObserved`` if the node did not move the robot."""
    scene = observation.enter_scene(name)
    if scene.facts[MOVED]:
        return scene
    reason = why_idle(scene)
    topics = scene.process.subscribed_topics
    if topics and '/' + CTRL_RELINQ_TOPIC not in topics:
        reason = f'it does not listen to {CTRL_RELINQ_TOPIC}'
    raise NotObserved(f'it got control, but did not move the robot: {reason}')


def _final_pose(scene: Scene) -> Pose2:
    """Returns the pose at the end of a drive, in the local frame."""
    return Pose2(*scene.facts[LOCAL_T_WORLD]) @ Pose2(*scene.truth[-1, 1:])


def _judge_printed_arrival(observation: Observation) -> Reason:
    names = (stimuli.FIRST_DRIVE, stimuli.AT_GOAL)
    printed = ''.join(observation.enter_scene(name).printed for name in names)
    count = len(re.findall(PRINTED_REACHED, printed, re.IGNORECASE))
    return '' if count == 1 else f'"{PRINTED_REACHED}!" was printed {count} times'


def _judge_silence_at_goal(observation: Observation) -> Reason:
    drive = _enter_drive(observation, stimuli.FIRST_DRIVE)
    if not drive.facts[RESTED]:
        return 'it never arrived'
    if ends_in_motion(drive.commands):
        return NO_ZERO_VELOCITY.format('its arrival')
    _, later = observation.enter_scene(stimuli.AT_GOAL).commands_before_and_after(LAST_COMMAND_TIME)
    return 'it went on sending commands on cmd_vel after it had arrived' if len(later) else ''


def _judge_speeds(observation: Observation) -> Reason:
    drives = observation.enter_scenes((stimuli.FIRST_DRIVE, stimuli.SECOND_DRIVE))
    commands = np.vstack([drive.commands for drive in drives])
    if not len(commands):
        return 'it commanded nothing'
    for column, limit in ((LINEAR, MAX_LINEAR_SPEED), (ANGULAR, MAX_ANGULAR_SPEED)):
        if observation.fastest_speed(commands, column) > limit + ROUNDING_TOLERANCE:
            linear, angular = np.abs(commands[:, LINEAR:]).max(axis=0)
            return f'it commanded up to {linear:.2f} m/s and {angular:.1f} rad/s'
    return ''


def _judge_answer_of_reset(observation: Observation, name: str = stimuli.RESET_TO_ORIGIN) -> Reason:
    problem = observation.enter_scene(name).facts[stimuli.RESET_PROBLEM]
    if not problem:
        return ''
    advice = ' (does its callback return a response?)' if 'returned None' in problem else ''
    return f'the reset failed: {problem}{advice}'


def _judge_reset(observation: Observation) -> Reason:
    reason = _judge_answer_of_reset(observation)
    if reason:
        return reason
    wrong_name = observation.enter_scene(stimuli.RESET_TO_ORIGIN).facts[stimuli.WRONG_NAME]
    if wrong_name:
        return f'its reset is called {wrong_name}, not /{SET_POSE_SERVICE}'
    return _judge_reset_in_drive(observation)


def _judge_reset_in_drive(observation: Observation) -> Reason:
    scene = observation.enter_scene(stimuli.RESET_IN_DRIVE)
    if scene.facts[WAS_MOVING] and not scene.facts[stimuli.DROVE_STRAIGHT]:
        return 'turned to its goal by hand after a reset, it did not drive straight there'
    reason = _judge_answer_of_reset(observation, stimuli.RESET_IN_DRIVE)
    if reason:
        return reason
    if not scene.facts[WAS_MOVING] or abs(scene.turned_deg) >= MIN_TURN_IN_DRIVE_DEG:
        return ''
    return ('after a reset in the middle of a drive it did not turn to the goal of the new frame, '
            f'but by {scene.turned_deg:.0f} degrees in {stimuli.TURN_TIME_IN_DRIVE:g} s')


def _judge_wait(observation: Observation) -> Reason:
    """Judges whether the robot rested while the node had no control: after the start of the node,
    and during a reset."""
    has_moved = len(observation.enter_scene(stimuli.WITHOUT_CONTROL).moving_commands) > 0
    if not has_moved and observation.has_stimulus(stimuli.RESET_TO_ORIGIN):
        reset = observation.enter_scene(stimuli.RESET_TO_ORIGIN, may_die=True)
        has_moved = len(reset.moving_commands) > 0 and not reset.facts[WAS_MOVING]
    if not has_moved:
        return ''
    return ('it moved the robot without having control: does control_loop look at has_control, '
            'which is False at the start, and which True on ctrl_relinq sets and False clears?')


def _judge_stop_without_control(observation: Observation) -> Reason:
    if not observation.enter_scene(stimuli.CONTROL_TAKEN).facts[WAS_MOVING]:
        return 'it did not move the robot, so that a stop could not be seen'
    return judge_stop(observation, stimuli.CONTROL_TAKEN, 'control was taken')


def _judge_accuracy(observation: Observation) -> Reason:
    names = [stimuli.SECOND_DRIVE]
    if stimuli.DRIVE in dict(observation.parts):
        names.insert(0, stimuli.FIRST_DRIVE)
    for name in names:
        reason = (_judge_goal_place(observation, name, EXACT_DISTANCE)
                  or _judge_goal_heading(observation, name, EXACT_DEG))
        if reason:
            return reason
    return ''


def _judge_arrival(observation: Observation, name: str) -> Reason:
    return _judge_goal_place(observation, name) or _judge_goal_heading(observation, name)


def _judge_after_reset(observation, reset, judge, name):
    """Judges the stimulus `reset`, then the drive `name` by ``judge(observation, name)``."""
    return _judge_answer_of_reset(observation, reset) or judge(observation, name)


def _judge_printed_reset(observation: Observation) -> Reason:
    printed = observation.enter_scene(stimuli.RESET_TO_ORIGIN).printed
    if PRINTED_POSE_SET.lower() in printed.lower():
        return ''
    return f'no line "{PRINTED_POSE_SET} to x=..., y=..., yaw=..." was printed'


CRITERIA = [
    Criterion('starts', stimuli.DRIVE, 'runs and listens to odom', STATES_SECTION, judge_start,
              limits=START_LIMITS),
    Criterion('waits', stimuli.DRIVE, 'does not move before it has control', STATES_SECTION,
              _judge_wait, limits=f'for {stimuli.OBSERVATION_TIME:g} s, and after a reset'),
    Criterion('goal_place', stimuli.DRIVE, f'drives to ({GOAL_X:g}, {GOAL_Y:g})', STATES_SECTION,
              partial(_judge_goal_place, name=stimuli.FIRST_DRIVE), limits=PLACE_LIMITS),
    Criterion('goal_heading', stimuli.DRIVE, FACES_GOAL + ' there', STATES_SECTION,
              partial(_judge_goal_heading, name=stimuli.FIRST_DRIVE), limits=HEADING_LIMITS),
    Criterion('says_reached', stimuli.DRIVE, f'says "{PRINTED_REACHED}!" once', STATES_SECTION,
              _judge_printed_arrival),
    Criterion('silent_at_goal', stimuli.DRIVE, 'sends nothing on cmd_vel at the goal',
              STATES_SECTION, _judge_silence_at_goal, limits='a zero velocity, then nothing from '
              f'{LAST_COMMAND_TIME:g} s after its arrival on'),
    Criterion('within_limits', stimuli.DRIVE, "keeps the robot's limits, "
              f'{MAX_LINEAR_SPEED:g} m/s and {MAX_ANGULAR_SPEED:g} rad/s', STATES_SECTION,
              _judge_speeds, limits=f'and {ROUNDING_TOLERANCE:g} for rounding'),
    Criterion('resets', stimuli.RESET,
              f'a service /{SET_POSE_SERVICE} resets the local frame, also in a drive',
              RESET_SECTION, _judge_reset,
              limits=f'answers {within(stimuli.RESET_REPLY_TIME)}; in a drive it turns by '
              f'{MIN_TURN_IN_DRIVE_DEG:g} degrees {within(stimuli.TURN_TIME_IN_DRIVE)}'),
    Criterion('says_reset', stimuli.RESET, f'says "{PRINTED_POSE_SET} to x=..., y=..., yaw=..."',
              RESET_SECTION, _judge_printed_reset,
              limits=within(stimuli.PRINT_AFTER_RESET_TIME) + ' after the answer'),
    Criterion('second_place', stimuli.RESET, 'does the same task after a turn by '
              f'{stimuli.TURN_BEFORE_RESET_DEG:g} degrees and a reset', SECOND_DRIVE_STEP,
              partial(_judge_after_reset, reset=stimuli.RESET_TO_ORIGIN,
                      judge=_judge_goal_place, name=stimuli.SECOND_DRIVE),
              limits='as goal_place'),
    Criterion('second_heading', stimuli.RESET, FACES_GOAL + ' of the new frame', SECOND_DRIVE_STEP,
              partial(_judge_after_reset, reset=stimuli.RESET_TO_ORIGIN,
                      judge=_judge_goal_heading, name=stimuli.SECOND_DRIVE),
              limits='as goal_heading'),
    Criterion('control_taken', stimuli.CONTROL, 'stops the robot at once when control is taken',
              STATES_SECTION, _judge_stop_without_control, limits='zero velocity ' + STOP_LIMITS),
    clean_exit_criterion(stimuli.CONTROL, STATES_SECTION),
    Criterion('stops_robot', stimuli.CONTROL, 'at Ctrl+C in a drive sends zero velocity', EXTRAS,
              judge_stop_at_ctrl_c, is_extra=True, limits=STOP_LIMITS),
    Criterion('exact', stimuli.RESET,
              f'both drives are within {EXACT_DISTANCE:g} m and {EXACT_DEG:g} degree',
              SheetStep(TRANSFORMATION_SHEET, '6. Analysis'), _judge_accuracy, is_extra=True),
    Criterion('declared_pose', stimuli.DECLARED,
              'drives from a declared pose that is not the origin', EXTRAS,
              partial(_judge_after_reset, reset=stimuli.RESET_ELSEWHERE,
                      judge=_judge_arrival, name=stimuli.DECLARED_DRIVE),
              is_extra=True, limits='as goal_place and goal_heading'),
    Criterion('offset_imu', stimuli.OFFSET,
              'drives although the zeros of IMU and odometry differ', LOCAL_POSE_SECTION.at_step(4),
              partial(_judge_arrival, name=stimuli.OFFSET_DRIVE), is_extra=True,
              limits='as goal_place and goal_heading'),
    lost_device_criterion('lost_odometry', 'stops the robot', 'the odometry',
                          stimuli.ODOMETRY_SILENT, EXTRAS),
]
