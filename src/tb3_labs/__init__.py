"""Two robotics labs. Each folder answers one question; its `__init__.py` says which.

Imports only go down: scripts -> ros -> marking -> report -> simulation -> nodes -> control ->
localization, supervision -> robot -> geometry. All but `ros` is pure Python and numpy: no ROS, no
clock, no print. Time comes in as `now` or `dt` in seconds. Angles are radians, counter-clockwise
positive; lengths are metres.
"""
