"""How does the embedded robot appear to ROS? On the topics and the clock of a real one."""
