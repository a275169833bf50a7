"""Which robot is it, and what does it send? This folder contains the numbers of the TurtleBot3
models, and the types of the samples that their sensors send.
"""
