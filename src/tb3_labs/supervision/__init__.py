"""May the robot move, and who drives it? A stop stays a stop:

1. *A stop is obeyed*, whoever sends it. Only a True may be ignored (`permission`).
2. *Old messages give nothing*. A message is old if it is repeated, late or latched (`events`), or
   if the node has just woken (`timeouts`). An old request of a reset is ignored, too.
3. *A new grant* is needed after any stop or timeout: a False, then a True, of one sender
   (`permission`).
4. *It needs its robot*. Without fresh sensors a grant, a goal or a turn is void
   (`sensors_and_stalls`).
5. *A stop reaches hands*. After a stop, a stick (`control_holder`) or mouse (nodes/controller) does
   not drive until it was in its middle. A page (`dead_man`) does not drive until a person grips it
   again.
6. *A cancel* ends its goal. A repetition does not start the goal again (`goal_requests`).
7. *Used is used up*. A permission that a person types holds for one start of the node
   (nodes/move_to_goal).

`control_holder` has the table of the holder of the robot, and nodes/controller/turns.py has the
table of the driver. `timeouts` has the limit of each silence.
"""
