"""The node `gamepad`: it decides who holds the robot, and reads the sticks."""
