"""How did the robot move? The movements, turns, drives and resets of a run."""
