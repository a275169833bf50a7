"""The numbers, names and printed words of the two handouts. Each is defined only here.

This module imports nothing, so every other module may read it. The plain nodes in scripts/ and the
skeletons are the handouts' own text: they repeat these values, and test_handout.py compares them.
"""
# -- the IMU exercise and the IMU lab

#: The angle of a turn, and how far from its goal a turn may end [deg].
TURN_DEG, HDG_TOL = 90.0, 10.0
#: The keys of a turn to the left, and of a turn to the right.
LEFT_KEY, RIGHT_KEY = 'l', 'r'
#: The command for each degree of error; the slowest and the fastest turn [rad/s].
K_HDG, MIN_ANG_Z, MAX_ANG_Z = 0.1, 0.5, 1.5
#: The mouse commands zero within this distance of the screen's middle, from -1 to 1. At the edge of
#: the screen it commands MOUSE_FULL [m/s], [rad/s].
MOUSE_DEAD_ZONE, MOUSE_FULL = 0.25, 0.5
#: The line with a heading, and the last line of each node.
PRINTED_HEADING = 'Current heading is {} degrees'
IMU_GOODBYE = 'Shutting down the IMU subscriber'
CONTROLLER_GOODBYE = 'Controller exiting. Halting robot.'

# -- the Transformation lab

#: The goal in the local frame: x, y [m], heading [deg]. This is the line to edit for another goal.
GOAL_X, GOAL_Y, GOAL_YAW_DEG = -0.61, 0.61, 0.0
STATES = ROTATE_TO_GOAL, MOVE_FORWARD, ROTATE_TO_FINAL, GOAL_REACHED = (
    'ROTATE_TO_GOAL', 'MOVE_FORWARD', 'ROTATE_TO_FINAL', 'GOAL_REACHED')
#: Both rotations end within ANGLE_TOLERANCE [rad], the way forward within DISTANCE_TOLERANCE [m].
ANGLE_TOLERANCE, DISTANCE_TOLERANCE = 0.05, 0.15
#: The gain of each rotation [1/s], and the speed of the way forward [m/s].
GAIN_TO_GOAL, GAIN_TO_FINAL, DRIVE_SPEED = 0.3, 0.5, 0.15
#: The limits in the robot's data sheet [m/s], [rad/s]. A full stick commands them.
MAX_SPEED, MAX_TURN = 0.22, 2.84
#: The numbers of the pad's axes and buttons, which count from 0.
LINEAR_AXIS, ANGULAR_AXIS = 1, 3
BUTTON_A, BUTTON_B, BUTTON_Y = 0, 1, 2
#: Three lines of the nodes begin with these words.
PRINTED_REACHED = 'Goal reached'
PRINTED_POSE_SET = 'Local pose set'
PRINTED_RESET = 'Pose reset successfully'

# -- the relative names of topics, and of the service of both labs

IMU_TOPIC, ODOM_TOPIC, JOY, MOUSE_INFO = 'imu', 'odom', 'joy', 'mouse_info'
CTRL_RELINQ, CMD_VEL, SET_POSE = 'ctrl_relinq', 'cmd_vel', 'set_pose'
