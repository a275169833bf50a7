"""What does each node decide? A node that decides something has a folder in this package. The
folder contains the node's core, without ROS and clocks, and the files `ros_*.py`, with both.

The class :class:`tb3_labs.ros.core_runner.CoreRunner` calls the methods of every core. The method
``on_<what>(...)`` gives the core a sample, a message or a request. A message that a person may have
caused is an events.IncomingMessage. A *steady* clock never stands still and never goes back.

The core decides in ``tick(now)``, which returns one events.Output. CoreRunner calls `tick` after
each message, and ten times a second. After an Output with `needs_fast_ticks`, CoreRunner calls
`tick` more often, as messages may stop. The core needs no IMU sample for ``idle_time(now)`` s.

The methods ``status(now)`` and ``problem_text(now)``, and all properties, do not change the core.
"""
