"""May the robot move, and who drives it?

`permission` is the rule by which move_to_goal may drive; `driver` and `holder` have the tables of
who drives and who holds the robot. `freshness` shows how old something is that was heard. `motion_watch` finds
sensors that are lost (also in a stall of the network) or frozen, and a robot that does not obey;
`grip` is the rule by which a page may drive. `update(...)` tells a watch what happened; only this
changes it. `problem()` returns the reason to stop, or ''.
"""
