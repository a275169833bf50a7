"""The topics that the labs are about, as the handouts call them. All names are relative."""

IMU = 'imu'
ODOM = 'odom'
JOY = 'joy'
MOUSE_INFO = 'mouse_info'
CTRL_RELINQ = 'ctrl_relinq'
CMD_VEL = 'cmd_vel'
