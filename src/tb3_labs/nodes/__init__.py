"""What does each node decide? Each node of `scripts/` that decides something has a folder here: its
core, which knows neither ROS nor a clock, and its ROS side in files `ros_*.py`.

How every core is used (:class:`tb3_labs.ros.core_runner.CoreRunner` does so):

* *In*: ``on_<what>(...)`` takes in a sample, a message or a request, and answers nothing. A message
  that a person may have caused comes as an events.Event.
* *Out*: ``tick(now)`` looks at the clock and decides. It returns one events.Output: the command,
  and all else that the node must do once. Call `tick` after each message, and ten times a second.
  While an Output is `watched`, call `tick` more often, since messages may stop. For the time of
  ``idle_for(now)`` no sample of the IMU needs to be read.
* *State*: properties, ``status(now)``, ``problem(now)``. They change nothing.
"""
