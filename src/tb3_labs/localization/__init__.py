"""Where is the robot, and when was that measured?

From the samples of both sensors to a pose in the local frame. Nothing here decides how to move.
"""
