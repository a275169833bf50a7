"""How to move? Speed laws, the braking approach, turns, and drives to a goal in four states.

A law (turning.PreciseTurn, drive_law.DriveLaw) gives the command for a pose. `supervision`
decides whether the robot may move. An `approach` has the braking speed, and brakes in spite of
delays. `commands` has the times of the commands, and the commanded travel that the robot has not
driven yet. `motor_response` identifies delay, lag and gain of the motors.
"""
