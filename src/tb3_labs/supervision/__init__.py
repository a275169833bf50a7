"""May the robot move, and who drives it?

Lost or frozen sensors, a stalled robot, a process that slept, permission to drive, and the choice
of the driver. `update(...)` tells a watch what happened; only this changes it. `problem()` returns
the reason to stop, or ''.
"""
