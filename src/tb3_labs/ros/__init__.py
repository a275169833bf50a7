"""How do the pure rooms meet ROS? The files are under every node, the folders under some of them.

Threads and the order of locks: :mod:`tb3_labs.ros.node`. Clocks and waiting:
:mod:`tb3_labs.ros.clocks`. Printing: :mod:`tb3_labs.ros.console`.
"""
