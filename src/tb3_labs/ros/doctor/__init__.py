"""How does the doctor measure? Sockets, files and the ROS protocols, without rospy.

Nothing here registers at the master, publishes, or changes anything: a question is an XML-RPC call
that only reads, and listening is a connection to the publisher itself. So it works where rospy
cannot be imported or would wait. Every question has a deadline (:mod:`.deadline`). Neither the
names' resolver nor a slow peer can hold the doctor up: what waits is a daemon thread that is left.
"""
