"""Which robot is it, and what does it say? Its numbers with their sources, its samples, its URDF.

What is true of every TurtleBot3, real or embedded, lives here; how one is imitated, in `simulation`.
"""
