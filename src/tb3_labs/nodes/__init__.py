"""What does each node decide? If a node of `scripts/` decides something, it has a folder here. The
folder has the node's core, which knows neither ROS nor a clock, and the files `ros_*.py`, which
know both.

:class:`tb3_labs.ros.core_runner.CoreRunner` uses every core as follows:

* *In*: ``on_<what>(...)`` takes in a sample, a message or a request, and returns nothing. If a
  person may have caused a message, it comes as an events.Event.
* *Out*: ``tick(now)`` looks at the clock and decides. It returns one events.Output, which has the
  command, and everything else that the node must do. `tick` is called after each message, and ten
  times a second. While an Output is `watched`, `tick` is called more often, since messages may
  stop. ``idle_for(now)`` is the time for which no sample of the IMU needs to be read.
* *State*: properties, ``status(now)`` and ``problem_text(now)`` change nothing.
"""
