"""The node `controller` turns the robot by keyboard and IMU, and drives the robot by the mouse."""
