"""How do the notions meet ROS? These files are the bridge that every node needs.

`node` starts and ends a node, `clocks` waits, `topics` subscribes. Nodes that drive also use
`sensor_topics`, `parameters` and `live_settings`. `reset_client` calls a reset. `core_runner`
guards a core by a lock, states the order of locks, and sends commands. The ROS side of a node
stands beside its core.
"""
