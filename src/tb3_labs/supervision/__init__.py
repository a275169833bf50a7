"""May the robot move, and who drives it?

A stop stays a stop: motion never starts because a stop is released, repeated or forgotten. The
instructor's page on failures has the rules.

`control_holder` has the table of the holder of the robot, and nodes/controller/turns.py has the
table of the driver. `timeouts` has the limit of each silence.
"""
