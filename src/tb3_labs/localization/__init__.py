"""Where is the robot, and when was that measured?

From the samples of both sensors to a pose in the local frame. This room does not decide how to move.
"""
