"""How did the robot move? Its movements, turns and drives, between resets."""
