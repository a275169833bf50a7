"""What must a node of a lab do? Criteria and stimuli (LAB.py), scripts of trials (ros_LAB.py)."""
