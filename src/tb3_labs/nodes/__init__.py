"""What does each node decide? One file for each node of `scripts/` that decides something, named
as the node, with its core; and the notions that only one core reads (`pad`, `mouse`, `turn`, ...).

How every core is used:

* *In*: samples, messages and requests go in by methods, with the time of their arrival (`now`).
  `update...(now)` has the core look at the clock, where no message comes.
* *The command*: `due(now)` asks whether one is due; `command(now)` takes the step and returns it: a
  Twist2 to send, or None: be silent, after one zero if the robot was being driven.
* *Events*, which happen once: `take_...()` hands over those since the last call, in order.
* *State*: properties, `status(now)`, `problem(now)`. A question never changes anything.
* *A request that takes time* returns its handle at once (localizer.Reset), which shows what becomes
  of it.
* *A refusal* is a ``ValueError`` with the reason.
"""
