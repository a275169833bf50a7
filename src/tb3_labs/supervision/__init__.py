"""May the robot move, and who drives it? A stop stays a stop:

1. *A stop is obeyed*, whoever sends it. Only a grant may be ignored (`permission`).
2. *Old messages give nothing*: repeated, late, latched (`events`), or read by a node that woke
   (`timeouts`). This holds for each message that moves the robot or its frame, also for a reset.
3. *A new grant* is a False, then a True, of one sender after any stop or lapse (`permission`).
4. *It needs its robot*: without fresh sensors a grant, a goal or a turn is void
   (`stale_or_stalled`).
5. *A stop reaches hands*: after it, sticks (`control_holder`) and mouse (nodes/controller) do not
   drive until they were in their middle, nor a page until a person grips it again (`dead_man`).
6. *A cancel* ends the goal that it means, and a goal that is repeated stays ended
   (`goal_requests`).
7. *Used is used up*: a permission that is typed holds for one start (nodes/move_to_goal).

`control_holder` has the table of who holds the robot, nodes/controller/turns.py the table of who
drives. `timeouts` measures silences, and has the limit of each. `stale_or_stalled` finds sensors
that are lost (also in a stall of the network) or frozen, and a robot that does not obey.
"""
