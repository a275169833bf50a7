"""Which data of a robot does a page in a browser show, and which requests may the page send?

The panel sends pictures to a page. A picture is a JSON object that describes the robot, and
:mod:`tb3_labs.panel.robot_view` lists its entries. A page sends requests to the panel, and
:mod:`tb3_labs.panel.requests` lists the requests. If a person presses A, ``page/pad.js`` sends a
request. Then :mod:`tb3_labs.panel.ros_control` publishes `joy` for the node `gamepad`.

The thread `server` runs the event loop of the web server. Only the thread `server` uses the pages
and the DeadMan, so these objects need no lock. Threads of rospy write messages into a RobotView,
which a lock guards. If another thread has work for the thread `server`, it calls
``Server.call_soon()``. Calls of services and of the master run in separate threads, because a stop
must not wait for their answers.
"""
