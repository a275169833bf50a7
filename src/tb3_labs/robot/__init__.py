"""Which robot is it, and what does it send? The numbers of the TurtleBot3s, and their samples.

The room knows no difference between a real and a simulated robot.
"""
