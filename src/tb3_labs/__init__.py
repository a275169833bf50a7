"""Two robotics labs. Each folder answers one question, which its `__init__.py` asks.

A file imports only from its own folder, and from folders further to the right:

    scripts -> tools (report, marking, panel, doctor, simulation) -> ros -> nodes
    -> control, localization, watch -> robot, supervision -> geometry

From `nodes` to `geometry`, only the files `ros_*.py` and the probe of `watch` use ROS or a clock.
The other files get the time as `now` or `dt` in seconds. Angles are radians, counter-clockwise
positive. Lengths are metres. `handout.py` has the numbers of both handouts.

Each default value is in a Config class, in the file that uses the value. `git grep '(Config)'`
lists all Config classes.
"""
