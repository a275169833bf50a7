"""May the robot move, and who drives it? A stop stays a stop:

1. *A stop is obeyed*, whoever sends it. Only a grant may be ignored (`permission`).
2. *Old messages give nothing*: repeated, late, latched (`events`), or read by a node that woke
   (`timeouts`). This holds for all that moves the robot, or its frame: a reset, too.
3. *A new grant* is a False, then a True, of one sender after any stop or lapse (`permission`).
4. *It needs its robot*: without fresh sensors a grant, a goal or a turn is void
   (`stale_or_stalled`).
5. *A stop reaches hands*: sticks (`control_holder`) and mouse (nodes/controller) drive again once
   they were in their middle. A page drives once a person grips it again (`dead_man`).
6. *A cancel* ends the goal that it means, and a goal that is repeated stays ended
   (`goal_requests`).
7. *Used is used up*: a permission is typed for one start, not a parameter (nodes/move_to_goal).

`control_holder` has the table of who holds the robot, nodes/controller/turns.py the table of who
drives. `timeouts` measures silences, and has the limits of all silences. `stale_or_stalled` finds
sensors that are lost (also in a stall of the network) or frozen, and a robot that does not obey.
"""
