"""The node `move_to_goal`: its core, and its ROS side in the files ros_*.py."""
