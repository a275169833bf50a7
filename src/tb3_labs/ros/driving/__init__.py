"""What does a node that drives the robot need besides: who may drive, who else does, and the zero
at the end."""
