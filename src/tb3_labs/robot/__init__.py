"""Which robot is it, and what does it send? The numbers of the TurtleBot3 models, and the samples
of their sensors.
"""
