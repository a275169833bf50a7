"""How do the notions meet ROS? These files are the bridge that every node needs.

`node` starts and ends a node, and states the order of locks; `clocks` waits, `topics` listens.
Nodes that drive also use `sensor_topics`, `cmd_vel`, `parameters` and `display`. move_to_goal takes
its goals by `goals`, control and resets by `control_and_reset`; other nodes send the last two by
`operator`.
"""
