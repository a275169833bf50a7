"""Which data of a robot does a page in a browser show, and which requests may the page send?

:mod:`tb3_labs.panel.requests` lists the messages that a page sends, and
:mod:`tb3_labs.panel.robot_view` lists the entries of the picture that the panel sends. If a person
presses A, ``page/pad.js`` sends a message to the panel. Then :mod:`tb3_labs.panel.ros_control`
publishes `joy`, to which the node `gamepad` listens.

The thread `server` runs the event loop of the web server. Only the thread `server` uses the pages
and the DeadMan, so they need no lock. Threads of rospy use a lock when they write messages into a
RobotView. Work for the thread `server` goes through ``Server.call_soon()``. Separate threads call
services and the master, so a stop never waits for an answer.
"""
