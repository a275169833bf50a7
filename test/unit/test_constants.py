"""One name has one value, and a number that a stop or a limit hangs on changes on purpose only."""
import ast
import math
import pathlib
from collections import defaultdict

import pytest

from tb3_labs.control import (
    approach, dead_time, driving, goal_machine, motor_response, pace, robot_file, turning)
from tb3_labs.geometry import estimate, quaternions, se2
from tb3_labs.localization import (
    contradiction, heading, localizer, odometry_jumps, sample_buffer, sender_clock)
from tb3_labs.nodes import controller, demo, gamepad, mouse, pad, pad_config
from tb3_labs.robot import samples, turtlebot3
from tb3_labs.supervision import freshness, permission, stall

ROOT = pathlib.Path(__file__).resolve().parents[2]
#: The places of the names that are checked.
OURS = ('src/tb3_labs/localization/', 'src/tb3_labs/supervision/', 'src/tb3_labs/nodes/')


def constants():
    """{name: {path: value in the source}} of all numbers in capitals at the top of a module."""
    found = defaultdict(dict)
    for path in sorted((ROOT / 'src').rglob('*.py')) + sorted((ROOT / 'scripts').glob('*.py')):
        for node in ast.parse(path.read_text()).body:
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                name, text = node.targets[0].id, ast.dump(node.value)
                if name.isupper() and any(isinstance(part, ast.Constant) and isinstance(
                        part.value, (int, float)) for part in ast.walk(node.value)):
                    found[name][str(path.relative_to(ROOT))] = text
    return found


def test_a_name_has_one_value():
    ours = {name: places for name, places in constants().items()
            if any(path.startswith(OURS) for path in places)}
    assert len(ours) > 40
    assert {name: places for name, places in ours.items() if len(places) > 1} == {}


#: Numbers of the rooms that decide. Whoever changes one measures what that does (test/benchmark),
#: and changes it here, too.
NUMBERS = {
    approach.ApproachConfig: {
        'leave_alone': 0.0, 'backwards_from': 0.0, 'reversal_caution': 1.0, 'nudge_caution': 0.5,
        'nudge_time': 0.0, 'speed_is_prompt': False},
    dead_time: {'COMMAND_MEMORY': 1.4, 'LEAST_LAG': 1e-6},
    driving: {'OUTSIDE': 0.8},
    driving.LabLaw: {
        'period': 0.1, 'ROTATE_TO_GOAL_GAIN': 0.3, 'ROTATE_TO_FINAL_GAIN': 0.5,
        'ANGLE_TOLERANCE': 0.05, 'FORWARD_SPEED': 0.15, 'distance_tolerance': 0.15},
    driving.PreciseLaw: {
        'period': 1.0 / 30.0, 'FACING': 0.1, 'ALONG': 0.3, 'STOP_AHEAD': 0.0005,
        'LOOK_AHEAD': 0.2, 'REST_SPEED': 0.01},
    goal_machine: {'MORE_TRIES': 2},
    approach: {'SAME_MOMENT': 1e-6},
    motor_response: {
        'FIRST_LAG': 0.05, 'FIRST_DELAY': 0.5 / 30.0 + 0.025, 'MAX_DELAY': 0.4, 'MAX_LAG': 0.15,
        'COMMAND_TIME': 0.074 / 3.0, 'COMMAND_SPREAD': 0.025, 'LEAST_SAMPLE_DELAY': 0.0135,
        'MAX_SAMPLE_DELAY': 0.15, 'SLOW_LEARNING': 0.01, 'LONGEST_AGE': 0.1,
        'DOUBTS': (0.03, 0.03, 0.05), 'BELIEVED': 1e-6, 'TIME_DOUBT': 0.002,
        'LEARNING': 0.1, 'STEADY': 0.08, 'STEADY_TIME': 0.12, 'CRUISING': 0.5,
        'LEARNING_TIME': 1.5, 'ONSET': 0.03, 'SPEEDING_UP': (0.1, 1.5), 'TELLING': 0.2, 'PROMPT': 0.98,
        'RESOLUTION': 0.001, 'QUIET': 0.6},
    robot_file: {'SAME_MODEL': 0.2},
    pace: {'EARLY': 0.0035, 'LONGEST_IDLE': 0.036},
    turning: {'PERIOD': 1.0 / 30.0},
    turning.LabTurn: {'period': 0.1, 'MAX_ANGLE': math.pi},
    turning.PreciseTurn: {'period': 1.0 / 30.0, 'MAX_ANGLE': 100.0 * 2.0 * math.pi,
                                    'LONGEST_LOOK': 0.6},
    estimate: {'STANDARD_ERRORS': 2.0, 'CONTRADICTION': 4.0},
    quaternions: {'NORM_TOLERANCE': 0.05, 'MAX_TILT': math.pi / 4.0},
    contradiction: {
        'WORST_SLIP': 0.45, 'WORST_UNEVEN': 0.1, 'SLIP_TIME': 0.1, 'TURNING': 0.3,
        'STEADY_TURN': 0.1,
        'LAG': 0.13, 'LEAD': 0.04, 'SLIP': 0.055, 'UNEVEN': 0.033, 'DRIFT': 0.02,
        'UNEXPLAINED': 0.015, 'AGREED': 1.0, 'AT_REST': 0.024, 'STANDING_RATE': 0.03,
        'GYRO_GAP': 0.15, 'MEAN_ONLY': 0.08, 'WHEEL_GAP': 0.3, 'WHEEL_MEMORY': 0.6},
    localizer: {'MAX_EXTRAPOLATION': 2.0 / 30.0},
    samples.Motion: {
        'imu_age': 0.0, 'odometry_age': 0.0, 'yaw_noise': 0.0, 'extrapolated': 0.0},
    odometry_jumps: {
        'FASTEST': 0.5, 'FASTEST_TURN': 4.0, 'SLACK': 0.05, 'SLACK_TURN': 0.3,
        'LONGEST_SILENCE': 5.0, 'SPIKE': 10.0, 'ZERO_YAW': 0.01, 'ZERO_PLACE': 0.001,
        'RESET_SILENCE': 1.0, 'NEAR_ZERO_PLACE': 0.03, 'NEAR_ZERO_YAW': 0.1, 'RESTING_TURN': 0.1,
        'CALIBRATION_TURN': 0.005, 'STOPPING_TIME': 0.5},
    sample_buffer: {'MEMORY': 1.5, 'MAX_GAP': 0.3, 'MAX_BRIDGE': 1.0},
    sender_clock: {
        'WINDOW': 5.0, 'SMALL_STEP': 0.1, 'CLOCK_STEP': 1.0, 'LONG_SILENCE': 1.5,
        'MAX_REPEATS': 3, 'MAX_OFF': 1.0, 'MAX_BEHIND': 0.5, 'HEARD_BEFORE': 0.1},
    controller: {'DRIVEN_RATE': 0.1, 'JUDGING_RATE': 0.01},
    gamepad: {'HAND_BACK': 0.15},
    heading: {'STEADY_DOUBT': math.radians(0.02), 'HALF_STEP': 1.6e-5, 'SLOW': 0.2, 'EVEN': 0.03,
              'FARTHEST': 0.1, 'SHARE': 0.02},
    demo: {'TRULY_OFF': 0.01, 'TRULY_OFF_DEG': 0.5, 'LONGEST_DRIVE': 120.0},
    mouse: {'MOUSE_TIMEOUT': 0.2, 'MOUSE_DEAD_ZONE': 0.25, 'MOUSE_FULL': 0.5},
    se2: {'MAX_DISTANCE': 100.0, 'MAX_YAW_DEG': 360.0},
    pad: {'PAD_TIMEOUT': 0.25, 'LATENESS_SHOWS': 0.3, 'CROSSING': 0.3},
    pad_config: {'MOST': 31},
    samples: {'FARTHEST_TURN': 1.0, 'REST_LINEAR': 0.005, 'REST_ANGULAR': 0.03},
    turtlebot3: {'CONTROL_RATE': 30.0, 'COMMAND_TIMEOUT': 0.5},
    freshness: {'SENSOR_TIMEOUT': 0.22, 'RESUME_TIME': 2.0, 'FROZEN_TIME': 0.6, 'SURELY_DRIVES': 0.02, 'SURELY_TURNS': 0.1},
    permission: {'RENEWAL': 0.1, 'LAPSE': 0.5, 'LONGEST_LAPSE': 2.0, 'CONFIRMATION': 0.04,
                 'LONGEST_GAP': 1.0, 'WAKING': 0.3},
    stall: {'STALL_TIME': 1.3, 'STALL_STEP': 0.004, 'LONGEST_REST': 4.0,
            'AWAY_LIMIT': 0.8, 'MOVING': 0.005,
            'SETTLING_TIME': 0.03},
}


@pytest.mark.parametrize('place', NUMBERS, ids=lambda place: place.__name__)
def test_the_numbers_that_people_rely_on(place):
    assert {name: getattr(place, name) for name in NUMBERS[place]} == NUMBERS[place]


def test_no_number_of_the_rooms_that_decide_is_left_out():
    rooms = tuple('src/tb3_labs/{}/'.format(room)
                  for room in ('control', 'localization', 'supervision', 'nodes'))
    named = {name for numbers in NUMBERS.values() for name in numbers} | {'WORDS'}  # test_turning's
    assert {name for name, places in constants().items()
            if any(path.startswith(rooms) for path in places)} <= named
