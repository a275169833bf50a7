"""How to move? Speed laws, the braking approach, turns, and drives to a goal in four states.

A law (turning.PreciseTurn, drive_law.DriveLaw) gives the command for a pose. `supervision`
decides whether the robot may move. An `approach` brakes in spite of delays. `commands` has the
braking speed, the times of the commands, and the travel that is commanded but not driven yet.
`motor_response` identifies delay, lag and gain of the motors.
"""
