"""May the robot move, and who drives it?

Lost or frozen sensors, a stalled robot, a process that slept, permission to drive, and whose turn
it is. A watch is told by `update(...)` what happened, and answers `problem()`, '' being none: only
the update changes it.
"""
