"""Which robot is it, and what does it send? The numbers of the TurtleBot3s, and their samples.

This room is right for real and simulated robots.
"""
