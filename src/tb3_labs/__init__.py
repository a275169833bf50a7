"""The core of the two labs: pure Python and numpy, no ROS, no clock, no print.

Time comes in as ``now`` or ``dt`` in seconds. Angles are radians, counter-clockwise
positive; lengths are metres. What knows ROS lives in :mod:`tb3_labs.ros`.
"""
