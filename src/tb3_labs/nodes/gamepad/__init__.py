"""The node `gamepad` drives the robot by a pad and lets move_to_goal drive."""
