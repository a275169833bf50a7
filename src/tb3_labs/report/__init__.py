"""What did a recorded run show? From arrays to figures, numbers and a page; no ROS."""
