"""What does a page in a browser show of a robot, and what may a page request?

:mod:`tb3_labs.panel.requests` lists the messages that a page sends, and
:mod:`tb3_labs.panel.robot_view` lists the entries of the picture that the panel sends. A press of A
goes from ``page/pad.js`` to :mod:`tb3_labs.panel.ros_control`, which publishes it as a `joy` for
the node `gamepad`.

Threads: the thread `server` runs the event loop of the web server. Only this thread uses the pages
and the DeadMan, so pages and DeadMan need no lock. rospy's threads write the messages of topics
into a RobotView, under a lock, or pass a call to `server` by ``Server.call_soon()``. Services and
the master are called in separate threads, so a stop never waits for an answer.
"""
