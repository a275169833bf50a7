"""How did the robot move? Finds the movements, turns, drives and resets of a run.

If local_pose was not recorded, :mod:`tb3_labs.report.motion.movements` computes it.
Frames: ``odom`` (global), ``local`` (declared by the last reset), ``world`` (of the ground truth).
Units: metres, radians, seconds since the recording's start. A value that is not known is NaN.
"""
