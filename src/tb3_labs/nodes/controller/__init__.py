"""The node `controller` turns the robot by keyboard and IMU and drives it by the mouse."""
