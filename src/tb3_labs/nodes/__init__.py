"""What does each node decide? Each node of `scripts/` that decides something has its core here, in
NODE_core.py. `pad` and `mouse_reader` read the actions of a person; the numbers of a pad's buttons
are in launch/params/pad_*.yaml. `demonstration` is the table of demo.py.

How every core is used:

* *In*: samples, messages and requests go in by methods, with the time of their arrival (`now`).
  `update...(now)` makes the core look at the clock when no message comes: call it ten times a
  second. While `watched` is True, call it more often, since messages may stop.
* *The command*: `due(now)` asks whether a command is due. `command(now)` takes the step and returns
  the Twist2 to send. None means silence, after one zero if the robot was being driven. For the time
  of `idle_for(now)` no sample of the IMU needs to be read.
* *Events*, which happen once: `take_...()` returns those since the last call, in order. News are
  lines for the user.
* *State*: properties, `status(now)`, `problem(now)`. A question never changes anything.
* *A request that takes time* returns its handle at once (localizer.Reset), which shows the outcome.
* *A refusal* is a ``ValueError`` with the reason.
"""
