"""What is a student's node worth? Criteria and points of each lab, judged by what was observed.

LAB.py has the criteria of a lab, and ros_LAB.py the scripts by which its node is tried out. Names
that both use (parts, stimuli, facts, topics) are constants in LAB.py.
"""
