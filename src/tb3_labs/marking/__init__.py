"""What is a student's node worth? Criteria and points of each lab, judged by what was observed.

LAB.py has the criteria of a lab, and ros_LAB.py the scripts by which its node is tried out. Names
that both use (parts, stimuli, facts, topics) are constants in LAB.py.

A submission goes through intake, choice, workspace and sandbox. Its node is tried out on a stage,
which gives an Observation; the criteria give verdicts on it; marks, feedback and marks_folder keep
them. ros_marker does all this for a class. ros_checkoff needs only the stage and the criteria.
"""
