"""How did the robot move? Finds the movements, turns, drives and resets of a run."""
