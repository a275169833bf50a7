"""May the robot move, and who drives it? A stop stays a stop:

1. A stop of any sender is obeyed. Only a grant may be ignored (`permission`).
2. An old message does not move the robot or its frame. A message is old if it is repeated, late or
   latched (`events`), or if the node has just woken (`timeouts`).
3. After a stop or a timeout, a sender gives a new grant by a False, then a True (`permission`).
4. A grant, a goal or a turn is void without fresh sensors (`sensors_and_stalls`).
5. After a stop, a stick (`control_holder`) or mouse (nodes/controller) does not drive until it was
   in its middle, and a page (`dead_man`) does not drive until a person grips it again.
6. A cancel ends its goal. A repetition does not start the goal again (`goal_requests`).
7. A permission that a person types holds for one start of the node (nodes/move_to_goal).

`control_holder` has the table of the holder of the robot, and nodes/controller/turns.py has the
table of the driver. `timeouts` has the limit of each silence.
"""
