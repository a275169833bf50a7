"""Where is the robot, and when was its pose measured?

This room turns the samples of both sensors into a pose in the local frame. A reset passes from
`nodes/move_to_goal/ros_requests` to `nodes/move_to_goal/core`, and then to `localizer`. The
localizer carries out the reset: it declares the frame that `local_frame` describes.
"""
