"""Where is the robot, and when was that measured?

From the samples of both sensors to a pose in the local frame; not how to move.
"""
