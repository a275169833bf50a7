"""How does a node use ROS? Every node needs some of these files.

`early_signals` and `node` start and end a node. `clocks` defines the clocks. `topics` subscribes to
topics. Nodes that drive also use `sensor_topics`, `parameters` and `live_settings`. `reset_client`
calls a reset. `core_runner` guards a core by a lock, and states the order of locks. `cmd_vel` sends
the commands to the robot. The ROS side of a node is in the folder of the node's core.
"""
