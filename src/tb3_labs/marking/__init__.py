"""What is a student's node worth? Criteria and points of each lab, judged by what was observed.

Names that this room shares with tb3_labs.ros.marking (parts, stimuli, facts, topics) are constants
here, in the file of their notion.
"""
