"""Where is the robot, and when was its pose measured?

This folder computes poses in the local frame from samples of the IMU and the odometry. A request
for a reset passes from `ros_goals_and_resets` to `core`, both in `nodes/move_to_goal`, and then to
`localizer`, which declares a new `local_frame`.
"""
