"""How to move? Speed laws, the braking approach, turns, and drives to a goal in four states.

A law (turning.PreciseTurn, drive_law.DriveLaw) gives the command for a pose. `supervision`
decides whether the robot may move. `braking` computes the braking speed, and allows for delays.
`commands` keeps the commands with their times, and computes the commanded travel that the robot has
not driven yet. `motor_response` identifies delay, lag and gain of the motors.
"""
