"""The bridge between ROS and the core: what several nodes share and what knows ROS."""
