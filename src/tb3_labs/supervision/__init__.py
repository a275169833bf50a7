"""May the robot move, and who drives it?

`permission` is the rule by which move_to_goal may drive; `arbitration` has the tables of who drives
and who holds the robot. `freshness` finds sensors that are lost (also in a stall of the network)
or frozen, `stall` a robot that does not obey. `update(...)` tells a watch what happened; only this
changes it. `problem()` returns the reason to stop, or ''.
"""
