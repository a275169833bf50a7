"""How do the notions meet ROS? These files are the bridge that every node needs.

`node` starts and ends a node, and states the order of locks; `clocks` waits, `topics` listens.
Nodes that drive also use `sensor_topics`, `cmd_vel` and `parameters`; nodes that call for a reset
use `reset_call`; `gate` guards a core. The ROS side of a node stands beside its core.
"""
