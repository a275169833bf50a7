"""Which robot is it, and what does it send? This folder has the numbers of the TurtleBot3 models,
and the samples of their sensors.
"""
