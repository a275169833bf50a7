"""Which robot is it, and what does it send? Its numbers with their sources, and its samples.

This room holds for every TurtleBot3, real or simulated; `simulation` imitates one.
"""
