"""What would a robot do? The embedded TurtleBot3, part by part, its network, and whole motions.

`simulator` joins the parts; `rollout` lets a node drive it faster than real time.
"""
