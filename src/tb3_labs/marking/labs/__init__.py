"""The labs: what is done to a node (ros_LAB.py), and what is asked of it (LAB.py)."""
