"""What is a student's node worth? Criteria and points of each lab, judged by what was observed.

The criteria of a lab stand in imu.py, turn.py with mouse.py, move2goal.py and gamepad.py; ros_LAB.py
has the scripts by which its node is tried out. Names that both use (parts, stimuli, facts) are
constants in LAB.py. ros_turn.py has the scripts of both IMU labs.

One way leads in: a submission is laid out (intake, names), its node is chosen (choice, packages),
copied and built (workspace, messages_in_sandbox), and started in a sandbox (sandbox, processes).
check_LAB.test tries it out on a stage (ros_stage: ros_student_node, ros_types,
ros_robot), which gives an Observation (observation). The criteria give verdicts on it (criteria),
with the points of marks; a page shows them (feedback), and marks_folder keeps them. ros_marker does
all this for a class. A single check by rostest begins at the stage.
"""
