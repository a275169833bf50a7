"""Is the robot allowed to move, and which node drives it?

A motion never starts because a stop was released or repeated, or because a node forgot the stop.
The instructor's page on failures has the rules.

A table in `control_holder` decides between a pad and move_to_goal. A table in
nodes/controller/turns.py decides between a turn and the mouse.

Units: seconds on a steady clock (`now`), which never stands still and never goes back.
"""
