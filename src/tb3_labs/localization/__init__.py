"""Where is the robot, and when was that measured?

This room turns the samples of both sensors into a pose in the local frame. A reset comes as a call
to `nodes/move_to_goal/ros_requests`, and goes by `nodes/move_to_goal/core` to `localizer`, which
carries it out: it declares the frame that `local_frame` describes.
"""
