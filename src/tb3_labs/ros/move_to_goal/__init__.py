"""What does only `move_to_goal` show and hear? Goals, resets, frames, RViz, a drive's status."""
