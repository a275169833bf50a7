"""What knows ROS: under every node here, and a folder each for what only some of them need."""
