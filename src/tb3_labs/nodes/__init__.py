"""What does each node decide? A node that decides something has a folder in this package. The
folder contains the node's core, without ROS and clocks, and the files `ros_*.py`, with both.

The class :class:`tb3_labs.ros.core_runner.CoreRunner` calls the methods of every core. The method
``on_<what>(...)`` gives the core a sample, a message or a request. A message that a person may have
caused is an events.IncomingMessage. A *steady* clock never stands still and never goes back.

The core decides in ``tick(now)``, which returns one events.Output. CoreRunner calls `tick` after
most messages, and whenever no message has arrived for a short time. This time is even shorter after
an Output with `needs_fast_ticks`, because the core must then notice soon that messages are missing.
During the next ``idle_time(now)`` seconds the core needs no sample of the IMU.

The methods ``status(now)`` and ``problem_text(now)``, and all properties, do not change the core.
"""
