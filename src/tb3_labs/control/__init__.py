"""How to move? Speed laws, the braking approach, turns, and drives to a goal in four states.

A law says what to command for a given pose; whether the robot may move is decided in `supervision`.
"""
