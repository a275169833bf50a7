"""Drives to goals: the core of the node `move_to_goal`, and the ROS side in files ros_*.py."""
