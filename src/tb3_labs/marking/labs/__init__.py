"""What must a node of a lab do? LAB.py has the criteria, and ros_LAB.py the trials."""
