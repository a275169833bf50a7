"""How does the embedded robot appear to ROS? With the topics and the clock of a real one."""
