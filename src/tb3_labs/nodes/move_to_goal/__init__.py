"""The node `move_to_goal` drives the robot to goals."""
