"""How to move? Speed laws, the braking approach, turns, and drives to a goal in four states.

A law (approach.PreciseTurn, driving.PreciseLaw) gives the command for a pose; `supervision`
decides whether the robot may move. `speed_laws` has the braking law, and the rhythm of the commands
(`Pace`). An `approach` brakes by that law in spite of delays: `dead_time` knows the travel that is
commanded and not driven yet, and `motor_response` identifies delay, lag and gain.
"""
