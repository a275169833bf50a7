"""How do the notions meet ROS? These files are the bridge that every node needs.

`node` starts and ends a node; `clocks` waits, `topics` listens. Nodes that drive also use
`sensor_topics`, `parameters` and `live_settings`; a call of a reset is in `reset_client`;
`core_runner` guards a core by a lock, states the order of locks, and sends commands. The ROS side
of a node stands beside its core.
"""
