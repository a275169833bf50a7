"""How do the pure rooms meet ROS? The files are the bridge of every node; the folders go to the tools.

`node` starts and ends a node, and tells the order of locks; `clocks` waits, `console` prints,
`topics` listens. `cmd_vel`, `ctrl_relinq`, `goals`, `resets` and `display` are those of nodes that
drive.
"""
