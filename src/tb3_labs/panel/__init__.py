"""The page in a browser: what does it show of a robot, and what may it ask for?

:mod:`tb3_labs.panel.requests` lists the messages of a page, :mod:`tb3_labs.panel.robot_view` the
messages to it. A press of A goes from ``page/pad.js`` to :mod:`tb3_labs.panel.ros_control`, and
from there, as a `joy`, to the node `gamepad`.

Threads: the thread `server` runs the web server's event loop. Only this thread uses the pages and
the DeadMan, so they need no lock. rospy's threads write the messages of topics into a RobotView,
under its lock, or pass a call to `server` by ``Server.soon()``. Services and the master are called
in separate threads: a stop never waits for them.
"""
