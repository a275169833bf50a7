"""How to move? Speed laws, the braking approach, turns, and drives to a goal in four states.

A law (turning.TurningLaw, goal_machine.DrivingLaw) says what to command for a given pose; whether
the robot may move is decided in `supervision`. An approach brakes on two pieces: `dead_time` knows
what is commanded and not driven yet, `motor_response` identifies delay and lag. `pace` says when a
command is due, and which samples are read.
"""
