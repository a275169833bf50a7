"""What makes up the node move_to_goal? Its core, and beside it its ROS side: ros_*.py."""
