"""Driving by a pad, beside move_to_goal: the node `gamepad`."""
