"""What only `move_to_goal` shows and hears: goals, resets, frames, RViz, and its story in words."""
