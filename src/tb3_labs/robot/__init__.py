"""Which robot is it, and what does it send? The numbers of the TurtleBot3s, and their samples.

It does not matter here whether a robot is real or simulated.
"""
