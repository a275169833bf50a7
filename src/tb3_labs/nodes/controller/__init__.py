"""The node `controller` turns the robot by keyboard and IMU, or drives it by the mouse."""
