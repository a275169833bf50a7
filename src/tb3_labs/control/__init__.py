"""How does the robot move? This folder contains the laws for turns, and for drives to a goal.

A law, such as turning.PreciseTurn, computes the command from the robot's pose. `supervision`
decides whether the robot may move. `braking` stops the robot at its goal in spite of delays.
`commands` remembers the commands and computes the commanded travel that the robot has not driven
yet. `motor_response` identifies the motors' delay, lag and gain.
"""
