"""Two robotics labs. Each folder answers one question, which its `__init__.py` asks.

Imports only go down: scripts -> the tools (report, marking, panel, doctor, skeletons, simulation)
-> ros -> nodes -> control, localization -> robot, supervision -> geometry. The folders from `nodes`
down are the notions, in pure Python and numpy: no ROS, no clock, no print. Time comes in as `now`
or `dt` in seconds. Angles are radians, counter-clockwise positive. Lengths are metres.

Each default value is in a Config, in the file that uses it. `git grep '(Config)'` lists them all.
"""
