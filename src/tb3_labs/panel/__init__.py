"""The page in a browser: what does it show of a robot, and what may it ask for?

Messages of a page are listed in :mod:`tb3_labs.panel.requests`, messages to it in
:mod:`tb3_labs.panel.robot_view`. A person's act, such as A, goes from ``page/pad.js`` through
:mod:`tb3_labs.panel.ros_control`, as a `joy`, to the node `gamepad`.

Threads: `server` is the web server's, with an event loop. Only this thread uses the pages and the
DeadMan, so they need no lock. rospy's threads write the messages that they hear into a RobotView,
under its lock, or hand a call to `server` by ``Server.soon()``. Services and the master are called
in threads of their own: a stop never waits.
"""
