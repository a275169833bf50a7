"""Two robotics labs. Each folder answers one question, which its `__init__.py` asks.

Imports only go down: scripts -> the tools (report, marking, panel, doctor, simulation)
-> ros -> nodes -> control, localization, watch -> robot, supervision -> geometry. The folders from
`nodes` down are the notions, in pure Python and numpy: no ROS, no clock, no print. Only the files
`ros_*.py` of `nodes` know ROS. Time comes in as `now` or `dt` in seconds. Angles are radians,
counter-clockwise positive. Lengths are metres. `handout` has the numbers of the handouts.

Each default is in a Config, in the file that uses it. `git grep '(Config)'` lists all Configs.
"""
