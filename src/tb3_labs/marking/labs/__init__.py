"""What must a node of a lab do? LAB.py contains a lab's criteria, ros_LAB.py its trials."""
