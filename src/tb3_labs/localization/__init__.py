"""Where is the robot, and when was that measured?

This room turns the samples of both sensors into a pose in the local frame. `localizer` carries out
a reset, which declares the frame that `local_frame` describes.
"""
