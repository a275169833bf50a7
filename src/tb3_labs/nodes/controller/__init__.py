"""Turns by keyboard and IMU, beside the mouse: the node `controller`."""
