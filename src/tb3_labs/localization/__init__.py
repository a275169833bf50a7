"""Where is the robot, and when was its pose measured?

This room makes a pose in the local frame from the samples of both sensors. A reset passes from
`nodes/move_to_goal/ros_requests` to `nodes/move_to_goal/core`, and then to `localizer`, which
declares a new `local_frame`.
"""
