"""Where is the robot, and when was its pose measured?

This folder computes poses in the local frame from samples of the IMU and the odometry. The request
for a reset passes from `nodes/move_to_goal/ros_requests` through `nodes/move_to_goal/core` to
`localizer`, which declares a new `local_frame`.
"""
