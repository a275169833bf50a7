"""May the robot move, and who drives it?

Lost or frozen sensors, a robot that is stuck, permission to drive, and whose turn it is.
"""
