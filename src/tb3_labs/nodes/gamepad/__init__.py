"""Who holds the robot, and what do the sticks ask for? The node `gamepad`."""
