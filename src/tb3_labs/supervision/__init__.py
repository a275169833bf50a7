"""May the robot move, and who drives it? A stop stays a stop:

1. *A stop is obeyed*, whoever sends it. Only a grant may be ignored (`permission`).
2. *Old messages give nothing*. A message is old if it is repeated, late or latched (`events`), or
   read by a node that woke (`timeouts`). The rule holds for each message that moves the robot or
   its frame, also for a reset.
3. *A new grant* is a False, then a True, of one sender after any stop or timeout (`permission`).
4. *It needs its robot*: without fresh sensors a grant, a goal or a turn is void
   (`stale_or_stalled`).
5. *A stop reaches hands*. After a stop, sticks (`control_holder`) and mouse (nodes/controller) do
   not drive until they were in their middle. A page (`dead_man`) does not drive until a person
   grips it again.
6. *A cancel* ends its goal, and a goal that is repeated stays ended (`goal_requests`).
7. *Used is used up*: a permission that is typed holds for one start (nodes/move_to_goal).

`control_holder` has the table of the holder of the robot, and nodes/controller/turns.py has the
table of the driver. `timeouts` measures silences, and has each limit. `stale_or_stalled` finds lost
or frozen sensors, and a robot that does not obey.
"""
