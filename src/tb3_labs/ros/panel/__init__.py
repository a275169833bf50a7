"""How does a page in a browser reach the robots? The web server, and the topics that it stands for.

Threads: `server` is the web server's, and has an event loop. Cores of pages and wheels are used by
it alone, without a lock. rospy's threads write what they hear into a RobotView, under its lock, or
hand a call over by ``Server.soon()``. A service is called in a thread of its own. The thread
`master` does what waits for the master; no stop waits for it.
"""
