"""How do the notions meet ROS? These files are the bridge that every node needs.

`node` starts and ends a node, and states the order of locks; `clocks` waits, `topics` listens.
Nodes that drive also use `sensor_topics`, `parameters` and `live_settings`; a call of a reset is in
`reset_call`; `gate` guards a core, and sends its commands. The ROS side of a node stands beside
its core.
"""
