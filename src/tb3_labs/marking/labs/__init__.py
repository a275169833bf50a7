"""What must a node of a lab do? LAB.py has a lab's criteria, and ros_LAB.py has its trials."""
