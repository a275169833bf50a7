"""How do the notions meet ROS? These files are the bridge that every node needs.

`node` starts and ends a node, and tells the order of locks; `clocks` waits, `topics` listens. Nodes
that drive also use `cmd_vel`, `parameters` and `display`. `goals` and `resets` take those that
come to move_to_goal; `operator` has both sides of `ctrl_relinq`, and calls a reset.
"""
