"""The page in a browser: what does it show of a robot, and what may it ask for?

Messages of a page are listed in :mod:`tb3_labs.panel.requests`, messages to it in
:mod:`tb3_labs.panel.picture`. A page's action, such as "give control", goes from ``page/holder.js``
through :mod:`tb3_labs.panel.ros_robot` to the rule in :mod:`tb3_labs.panel.holder`.

Threads: `server` is the web server's, with an event loop. Only this thread uses pages and
holders, so they need no lock. rospy's threads write the messages that they hear into a RobotView,
under its lock, or hand a call to `server` by ``Server.soon()``. Each service is called in a thread
of its own. The thread `master` does everything that waits for the master, so a stop never waits.
"""
