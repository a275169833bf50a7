"""What do the numbers mean? Angles, quaternions, and poses in the plane.

`se2` has the rotation matrix and the poses. This room does not know robots.
"""
