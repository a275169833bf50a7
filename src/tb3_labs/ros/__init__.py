"""How do the notions meet ROS? These files are the bridge that every node needs.

`node` starts and ends a node, and tells the order of locks; `clocks` waits, `console` prints,
`topics` listens. Nodes that drive also use `cmd_vel`, `control_and_reset`, `goals` and `display`.
"""
