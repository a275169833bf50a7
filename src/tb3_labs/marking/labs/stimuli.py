"""Defines the names, values and times of the labs' stimuli, and the keys of the stimuli's facts.

mark.py repeats all trials after a change of this file.
"""
import math
from typing import NamedTuple

from tb3_labs.handout import (
    DRIVE_SPEED, GOAL_X, GOAL_Y, GOAL_YAW_DEG, LEFT_KEY, RIGHT_KEY, TURN_DEG)

# -- several labs

#: Keys of the facts about a Ctrl+C.
EXIT_SECONDS = 'took'       # the time [s] after which the node ended; None if it was killed
EXIT_SIGNAL = 'signal'      # the number of the signal that ended the node; 0 if no signal ended it
#: The times [s] within which a node must do the following.
START_TIME = 15.0           # A started node must subscribe to its topic.
EXIT_TIME = 5.0             # After Ctrl+C a node must end. rospy alone needs up to 2 s for this.
STOP_TIME = 0.5             # A node that must stop the robot "at once" must send a zero velocity.
LOST_STOP_TIME = 1.0        # A node must stop the robot if a sensor or a device sends nothing more.
DEVICE_LOST = 'lost'        # the part of a lab in which a sensor or an input device falls silent

# -- the IMU exercise

#: The parts of the exercise.
HEADING, ODD_SAMPLES = 'heading', 'odd samples'
#: {stimulus: the heading [deg] at which the robot stands}
STANDING_HEADINGS = {f'at {heading:g} degrees': heading for heading in (50.0, 150.0, 220.0, 350.0)}
READING_TIME = 1.5          # The node must print its line at each heading within this time [s].
#: The stimuli with samples that a real IMU seldom sends.
JUST_BELOW_ZERO, ZERO_QUATERNION = 'a hair below zero', 'a quaternion of zeros'
#: After the quaternion of zeros, the marker sends samples with this heading for this time [s].
VALID_HEADING_DEG = 57.0
VALID_HEADING_TIME = 0.9
HEADING_DEG = 'heading_deg'    # key of a fact: the IMU's heading [deg] while the robot stands

# -- the IMU lab

#: The parts of the lab.
TURNS, MOUSE = 'turns', 'mouse'
MOUSE_AND_TURNS, SHUTDOWN = 'both', 'shutdown'
#: The IMU falls silent during a turn, and the mouse falls silent during a drive.
IMU_SILENT, MOUSE_SILENT = 'IMU silent', 'mouse silent'


class TurnStimulus(NamedTuple):
    """A turn that the marker asks for."""

    typed: str              # the letter
    requested_deg: float    # left positive
    begins_deg: float       # the heading at which the turn begins
    slip: float = 0.0       # the share of the wheels' travel that slips
    crossing: str = ''      # 'across 180' or 'across 0' if the turn crosses this heading, else ''


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
TURN_REACTION_TIME = 3.0    # A turn must begin within this time [s] after the letter.
MAX_TURN_TIME = 8.0         # [s]
#: A turn may take this time [s] while the mouse is active. The turn is slow if the node sends a
#: zero velocity for each message of the mouse.
BESIDE_MOUSE_TIME = 2.0 * MAX_TURN_TIME
ANSWER_TIME = 1.0           # The node must answer an invalid input within this time [s].
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
#: {stimulus: the position (x, y) of the active mouse}. x is positive to the right, y is positive
#: upward, and both are from -1 to 1.
MOUSE_POSITIONS = {MOUSE_UP: (0.0, 1.0), MOUSE_NEAR_MIDDLE: (0.2, -0.2), MOUSE_LEFT: (-1.0, 0.0),
                   MOUSE_HALF_WAY: (0.6, -0.6)}
MOUSE_HOLD_TIME = 0.8       # [s]
MOUSE_REACTION_TIME = 4.0   # A mouse that is moved in a turn must drive the robot within this time.

# -- the Transformation lab, move to goal

#: The parts of the lab.
DRIVE, RESET, CONTROL = 'drive', 'reset', 'control'
DECLARED, OFFSET = 'declared', 'offset'
#: The stimuli, in the order of the parts. The last stimulus belongs to the part DEVICE_LOST.
WITHOUT_CONTROL, FIRST_DRIVE, AT_GOAL = 'without control', 'first drive', 'at the goal'
RESET_TO_ORIGIN, SECOND_DRIVE = 'reset to the origin', 'second drive'
RESET_IN_DRIVE, CONTROL_TAKEN = 'reset in a drive', 'control taken'
RESET_ELSEWHERE, DECLARED_DRIVE = 'reset to another pose', 'drive from a declared pose'
OFFSET_DRIVE, ODOMETRY_SILENT = 'drive with an offset IMU', 'odometry silent'
#: Keys of the facts about a reset.
RESET_PROBLEM = 'problem'       # a text that says why the reset failed; '' if it succeeded
WRONG_NAME = 'name'             # the name of the service if it is wrong; '' if it is right
DROVE_STRAIGHT = 'straight'     # the robot drove forward after the marker had turned it
OBSERVATION_TIME = 1.5          # The robot is watched for this time [s] when it should rest.
RESET_REPLY_TIME = 3.0          # The reset service must answer within this time [s].
#: The node must print its line about the reset within this time [s] after the service's answer.
PRINT_AFTER_RESET_TIME = 0.5
TURN_BEFORE_RESET_DEG = 100.0   # The marker turns the robot so far before the second drive.
TURN_TIME_IN_DRIVE = 3.0        # The node turns to its new goal for this time [s] after a reset.
GOAL = (GOAL_X, GOAL_Y, math.radians(GOAL_YAW_DEG))     # (x [m], y [m], heading [rad])
DRIVE_REACTION_TIME = 4.0       # A node that gets control must drive within this time [s].
GOAL_DISTANCE = math.hypot(GOAL_X, GOAL_Y)      # [m]
#: By the handout's law, the two rotations together need at most 22 s. This is twice that time [s].
MAX_DRIVE_TIME = math.ceil(44.0 + GOAL_DISTANCE / DRIVE_SPEED)
MAX_DRIVE_DISTANCE = math.ceil(1.0 + 2.0 * GOAL_DISTANCE)       # [m] from the start of the drive
#: The bearing [deg] of the goal after a reset to the origin.
GOAL_BEARING_DEG = math.degrees(math.atan2(GOAL_Y, GOAL_X))

# -- the Transformation lab, gamepad

#: The parts of the lab.
STICKS, BUTTONS, NO_SERVICE = 'sticks', 'buttons', 'no service'
LEFT_STICK_UP, LEFT_STICK_DOWN = 'left stick up', 'left stick down'
RIGHT_STICK_LEFT, RIGHT_STICK_RIGHT = 'right stick left', 'right stick right'
BOTH_STICKS, STICKS_LET_GO = 'left stick half up, right stick half right', 'sticks let go'
#: {stimulus: (left stick, right stick)}. The values are from -1 to 1. Up and left are positive.
STICK_POSITIONS = {
    LEFT_STICK_UP: (1.0, 0.0), LEFT_STICK_DOWN: (-1.0, 0.0),
    RIGHT_STICK_LEFT: (0.0, 1.0), RIGHT_STICK_RIGHT: (0.0, -1.0),
    BOTH_STICKS: (0.5, -0.5), STICKS_LET_GO: (0.0, 0.0)}
HAND_OVER, STICK_UP_AFTER_A = 'A', 'left stick up after A'
TAKE_BACK, STICK_UP_AFTER_B = 'B', 'left stick up after B'
RESET_BUTTON, RESET_WITHOUT_SERVICE = 'Y', 'Y without a service'
PAD_SILENT = 'pad silent'
#: Keys of the facts about the buttons A and B.
RELINQ_VALUE = 'relinquished'   # the last value on ctrl_relinq; None if no message arrived
IS_LATCHED = 'heard late'       # a new subscriber got the value that was sent before
#: Keys of the facts about the button Y.
CALL_COUNT = 'calls'
SERVICE_NAME = 'name'           # the name of the called service
IS_ORIGIN = 'origin'            # each call declared (0, 0, 0)
NONZERO_FIELDS = 'not zero'     # a text for each field that is not 0; not in older bags
IS_UNIT = 'unit'                # each quaternion had the length 1
STICK_HOLD_TIME = 0.8           # [s]
PUBLISH_TIME = 1.0              # After A or B, the node must publish within this time [s].
CALL_AFTER_Y_TIME = 2.5         # After Y, the node must call the reset within this time [s].
