"""How do the pure rooms meet ROS? Every node uses these files, some nodes use the folders.

Threads and the order of locks: :mod:`tb3_labs.ros.node`. Clocks and waiting:
:mod:`tb3_labs.ros.clocks`. Printing: :mod:`tb3_labs.ros.console`.
"""
