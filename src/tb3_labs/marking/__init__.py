"""Marks a node by what was observed of it, without ROS."""
