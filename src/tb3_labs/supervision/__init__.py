"""May the robot move, and who drives it?

A stop stays a stop. If a stop is released, repeated or forgotten, no motion starts. The rules are
on the instructor's page on failures.

`control_holder` has the table of the holder of the robot, and nodes/controller/turns.py has the
table of the driver. `timeouts` has the limit of each silence.
"""
