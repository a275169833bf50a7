"""The page in a browser: what does it show of a robot, and what may it ask for?

Messages of a page are listed in :mod:`tb3_labs.panel.requests`, messages to it in
:mod:`tb3_labs.panel.picture`. A page's action, such as "give control", goes from ``page/holder.js``
through :mod:`tb3_labs.panel.ros_robot` to the rule in :mod:`tb3_labs.panel.holder`.

Threads: `server` is the web server's, with an event loop. It alone uses pages and holders, without
a lock. rospy's threads write the messages that they hear into a RobotView, under its lock, or hand
a call over by ``Server.soon()``. A service is called in a thread of its own. The thread `master`
does all that waits for the master, so no stop waits for it.
"""
