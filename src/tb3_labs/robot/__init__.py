"""Which robot is it, and what does it send? The robots' numbers with sources, and the samples.

This room holds for every TurtleBot3, real or simulated. `simulation` imitates a TurtleBot3.
"""
