"""The topics that the labs are about, as the handouts call them. All names are relative."""

IMU = 'imu'
ODOM = 'odom'
JOY = 'joy'
MOUSE_INFO = 'mouse_info'
CTRL_RELINQ = 'ctrl_relinq'
CMD_VEL = 'cmd_vel'
#: The robot's own: its reset, what else it tells, and its time if that is simulated.
RESET = 'reset'
JOINT_STATES = 'joint_states'
CLOCK = 'clock'
#: The true pose of the embedded robot.
TRUTH = 'ground_truth'
