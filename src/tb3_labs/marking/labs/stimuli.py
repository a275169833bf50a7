"""Defines the names, values and times of the labs' stimuli, and the keys of the stimuli's facts.

mark.py repeats all trials after a change of this file.
"""
import math
from typing import NamedTuple

from tb3_labs.handout import GOAL_X, GOAL_Y, GOAL_YAW_DEG, LEFT_KEY, RIGHT_KEY, TURN_DEG

# -- several labs

#: Keys of the facts about a Ctrl+C.
EXIT_SECONDS = 'took'       # the time [s] until the node ended; None if it was killed
EXIT_SIGNAL = 'signal'      # the signal that ended the node; 0 without a signal
START_TIME = 15.0           # [s] until a started node must subscribe to its topic
EXIT_TIME = 5.0             # [s] until a node must end after Ctrl+C; rospy itself needs up to 2 s
STOP_TIME = 0.5             # [s] until the zero velocity of a stop that is "at once"
LOST_STOP_TIME = 1.0        # [s] until a node must stop after a sensor or a device fell silent
DEVICE_LOST = 'lost'        # the part of a lab in which a sensor or an input device falls silent

# -- the IMU exercise

#: The parts of the exercise.
HEADING, ODD_SAMPLES = 'heading', 'odd samples'
#: {stimulus: the heading [deg] at which the robot stands}
STANDING_HEADINGS = {f'at {heading:g} degrees': heading for heading in (50.0, 150.0, 220.0, 350.0)}
READING_TIME = 1.5          # [s] until the node must print its line at each heading
#: The stimuli with samples that a real IMU seldom sends.
JUST_BELOW_ZERO, ZERO_QUATERNION = 'a hair below zero', 'a quaternion of zeros'
#: After the quaternion of zeros, the marker sends samples with this heading for this time.
VALID_HEADING_DEG = 57.0
VALID_HEADING_TIME = 0.9       # [s]
HEADING_DEG = 'heading_deg'    # key of a fact: the IMU's heading [deg] while the robot stands

# -- the IMU lab

#: The parts of the lab.
TURNS = 'turns'
MOUSE = 'mouse'
MOUSE_AND_TURNS = 'both'
SHUTDOWN = 'shutdown'
#: In a turn the IMU falls silent. In a drive the mouse falls silent.
IMU_SILENT, MOUSE_SILENT = 'IMU silent', 'mouse silent'


class TurnStimulus(NamedTuple):
    """A turn that the marker asks for."""

    typed: str              # the letter
    requested_deg: float    # left positive
    begins_deg: float       # the heading at which the turn begins
    slip: float = 0.0       # the share of the wheels' travel that slips
    crossing: str = ''      # 'across 180' or 'across 0' if the heading jumps in the turn, else ''


#: The slip on a carpet, as a share of the wheels' travel. On a carpet, a node that turns for a
#: fixed time turns too little.
CARPET_SLIP = 0.3
#: {name of a stimulus: its turn}
TURN_STIMULI = {
    LEFT_KEY: TurnStimulus(LEFT_KEY, TURN_DEG, 40.0),
    'l across 180': TurnStimulus(LEFT_KEY, TURN_DEG, 130.0, crossing='across 180'),
    'r across 180': TurnStimulus(RIGHT_KEY, -TURN_DEG, 220.0, CARPET_SLIP, 'across 180'),
    RIGHT_KEY: TurnStimulus(RIGHT_KEY, -TURN_DEG, 130.0, CARPET_SLIP),
    'r across 0': TurnStimulus(RIGHT_KEY, -TURN_DEG, 40.0, CARPET_SLIP, 'across 0'),
    'l across 0': TurnStimulus(LEFT_KEY, TURN_DEG, -50.0, CARPET_SLIP, 'across 0'),
}
NONSENSE = 'nonsense'       # the stimulus of an invalid input
TYPED_NONSENSE = 'x'        # the invalid input
TURN_REACTION_TIME = 3.0    # [s] from the letter to the start of the turn
MAX_TURN_TIME = 8.0         # [s]
#: A turn may take this time [s] while the mouse is active. The turn is slow if the node sends a
#: zero velocity for each message of the mouse.
BESIDE_MOUSE_TIME = 2.0 * MAX_TURN_TIME
ANSWER_TIME = 1.0           # [s] until the node answers an invalid input
MOUSE_NOT_ACTIVE, MOUSE_DEACTIVATED = 'mouse not active', 'mouse deactivated'
MOUSE_UP, MOUSE_LEFT = 'mouse up', 'mouse left'
MOUSE_NEAR_MIDDLE, MOUSE_HALF_WAY = 'mouse near the middle', 'mouse half right and half down'
#: The stimuli in which only the mouse moves the robot.
MOUSE_ALONE = (MOUSE_NOT_ACTIVE, MOUSE_UP, MOUSE_NEAR_MIDDLE, MOUSE_LEFT, MOUSE_HALF_WAY,
               MOUSE_DEACTIVATED)
TURN_BESIDE_MOUSE = 'l beside the mouse'
MOUSE_AFTER_TURN, MOUSE_IN_TURN = 'mouse after a turn', 'mouse in a turn'
#: The stimuli in which the mouse and the keyboard move the robot.
BESIDE_TURNS = (TURN_BESIDE_MOUSE, MOUSE_AFTER_TURN, MOUSE_IN_TURN)
#: {stimulus: the position (x, y) of the active mouse}. x is positive to the right, y upward, both
#: from -1 to 1.
MOUSE_POSITIONS = {MOUSE_UP: (0.0, 1.0), MOUSE_NEAR_MIDDLE: (0.2, -0.2), MOUSE_LEFT: (-1.0, 0.0),
                   MOUSE_HALF_WAY: (0.6, -0.6)}
MOUSE_HOLD_TIME = 0.8       # [s]
MOUSE_REACTION_TIME = 4.0   # [s] until a mouse that is moved during a turn drives the robot

# -- the Transformation lab, move to goal

#: The parts of the lab.
DRIVE = 'drive'
RESET = 'reset'
CONTROL = 'control'
DECLARED = 'declared'
OFFSET = 'offset'
#: The stimuli, in the order of the parts. The final stimulus belongs to the part DEVICE_LOST.
WITHOUT_CONTROL = 'without control'
FIRST_DRIVE = 'first drive'
AT_GOAL = 'at the goal'
RESET_TO_ORIGIN, SECOND_DRIVE = 'reset to the origin', 'second drive'
RESET_IN_DRIVE = 'reset in a drive'
CONTROL_TAKEN = 'control taken'
RESET_ELSEWHERE, DECLARED_DRIVE = 'reset to another pose', 'drive from a declared pose'
OFFSET_DRIVE = 'drive with an offset IMU'
ODOMETRY_SILENT = 'odometry silent'
#: Keys of the facts about a reset.
RESET_PROBLEM = 'problem'       # why the reset failed; '' for a success
WRONG_NAME = 'name'             # a wrong name of the service; '' for the right name
DROVE_STRAIGHT = 'straight'     # the robot drove forward after the marker had turned it
OBSERVATION_TIME = 1.5          # [s] before the node has control, and at the goal
RESET_REPLY_TIME = 3.0          # [s] until the reset service answers
PRINT_AFTER_RESET_TIME = 0.5    # [s] from the service's answer to the node's line about the reset
TURN_BEFORE_RESET_DEG = 100.0   # between the first drive and the reset
TURN_TIME_IN_DRIVE = 3.0        # [s] for the turn to the new goal, after a reset in a drive
GOAL = (GOAL_X, GOAL_Y, math.radians(GOAL_YAW_DEG))     # (x [m], y [m], heading [rad])
DRIVE_REACTION_TIME = 4.0       # [s] from the moment when the node gets control
MAX_DRIVE_TIME = 50.0           # [s]
MAX_DRIVE_DISTANCE = 3.0        # [m] from the start

# -- the Transformation lab, gamepad

#: The parts of the lab.
STICKS = 'sticks'
BUTTONS = 'buttons'
NO_SERVICE = 'no service'
LEFT_STICK_UP, LEFT_STICK_DOWN = 'left stick up', 'left stick down'
BOTH_STICKS = 'left stick half up, right stick half right'
RIGHT_STICK_LEFT, RIGHT_STICK_RIGHT = 'right stick left', 'right stick right'
STICKS_LET_GO = 'sticks let go'
#: {stimulus: (left stick, up is positive; right stick, left is positive)}, each from -1 to 1
STICK_POSITIONS = {
    LEFT_STICK_UP: (1.0, 0.0), LEFT_STICK_DOWN: (-1.0, 0.0),
    RIGHT_STICK_LEFT: (0.0, 1.0), RIGHT_STICK_RIGHT: (0.0, -1.0),
    BOTH_STICKS: (0.5, -0.5), STICKS_LET_GO: (0.0, 0.0)}
HAND_OVER, STICK_UP_AFTER_A = 'A', 'left stick up after A'
TAKE_BACK, STICK_UP_AFTER_B = 'B', 'left stick up after B'
RESET_BUTTON, RESET_WITHOUT_SERVICE = 'Y', 'Y without a service'
PAD_SILENT = 'pad silent'
#: Keys of the facts about the buttons A and B.
RELINQ_VALUE = 'relinquished'   # the latest value on ctrl_relinq; None without a message
IS_LATCHED = 'heard late'       # a new subscriber got the value after A
#: Keys of the facts about the button Y.
CALL_COUNT = 'calls'
SERVICE_NAME = 'name'           # of the called service
IS_ORIGIN = 'origin'            # each call declared (0, 0, 0)
IS_UNIT = 'unit'                # each quaternion had the length 1
STICK_HOLD_TIME = 0.8           # [s]
PUBLISH_TIME = 1.0              # [s] from A or B to the node's value on ctrl_relinq
CALL_AFTER_Y_TIME = 2.5         # [s] from Y to the node's call of the reset, or to its error
