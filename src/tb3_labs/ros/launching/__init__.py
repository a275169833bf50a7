"""What would a roslaunch command start, and can it be started as it was asked for?

`scripts/check_launch.py` answers before anything is started, since roslaunch itself ignores unknown
arguments, and goes on without a node that ends at once.
"""
