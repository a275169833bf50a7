"""The numbers, names and printed words of the two handouts.

This module imports nothing, so every module may import it. The plain nodes in scripts/ and the
skeletons repeat numbers of this module. test_handout.py compares them.
"""
# -- the IMU exercise and the IMU lab

TURN_DEG = 90.0           # the angle of a turn [deg]
HDG_TOL = 10.0            # the largest error [deg] at the end of a turn
LEFT_KEY, RIGHT_KEY = 'l', 'r'
K_HDG = 0.1               # the command [rad/s] for each degree of error
MIN_ANG_Z = 0.5           # the slowest turn [rad/s]
MAX_ANG_Z = 1.5           # the fastest turn [rad/s]
MOUSE_DEAD_ZONE = 0.25    # the command is zero up to this distance from the middle; 1 is the edge
MOUSE_FULL = 0.5          # the command [m/s or rad/s] of a mouse at the edge of the screen
PRINTED_HEADING = 'Current heading is {} degrees'
#: Each node prints one of these lines when it exits.
IMU_GOODBYE = 'Shutting down the IMU subscriber'
CONTROLLER_GOODBYE = 'Controller exiting. Halting robot.'

# -- the Transformation lab

#: The goal in the local frame: x [m], y [m] and heading [deg]. To change the goal, edit this line.
GOAL_X, GOAL_Y, GOAL_YAW_DEG = -0.61, 0.61, 0.0
ROTATE_TO_GOAL = 'ROTATE_TO_GOAL'
MOVE_FORWARD = 'MOVE_FORWARD'
ROTATE_TO_FINAL = 'ROTATE_TO_FINAL'
GOAL_REACHED = 'GOAL_REACHED'
STATES = (ROTATE_TO_GOAL, MOVE_FORWARD, ROTATE_TO_FINAL, GOAL_REACHED)
ANGLE_TOLERANCE = 0.05      # the largest error [rad] at the end of each rotation
DISTANCE_TOLERANCE = 0.15   # the largest distance [m] from the goal after MOVE_FORWARD
GAIN_TO_GOAL = 0.3          # the gain of the first rotation [1/s]
GAIN_TO_FINAL = 0.5         # the gain of the last rotation [1/s]
DRIVE_SPEED = 0.15          # the speed in MOVE_FORWARD [m/s]
#: A fully pushed stick commands these speeds, which are the limits in the robot's data sheet.
MAX_LINEAR_SPEED = 0.22     # [m/s]
MAX_ANGULAR_SPEED = 2.84    # [rad/s]
PAD_AXES = 8                # number of axes of the most common pad
PAD_BUTTONS = 11            # number of its buttons
LINEAR_AXIS = 1             # index of the axis that drives
ANGULAR_AXIS = 3            # index of the axis that turns
BUTTON_A = 0                # index of the button A
BUTTON_B = 1
BUTTON_Y = 2
#: A printed line begins with one of these words.
PRINTED_REACHED = 'Goal reached'
PRINTED_POSE_SET = 'Local pose set'
PRINTED_RESET = 'Pose reset successfully'

# -- the relative names of topics, and of the service of both labs

IMU_TOPIC, ODOM_TOPIC, JOY_TOPIC, MOUSE_INFO_TOPIC = 'imu', 'odom', 'joy', 'mouse_info'
CTRL_RELINQ_TOPIC, CMD_VEL_TOPIC = 'ctrl_relinq', 'cmd_vel'
SET_POSE_SERVICE = 'set_pose'
