"""What is wrong with this computer, its network or a robot? Each finding is a line.

A function ``judge_*`` turns numbers and names into one line: ok, warning or fault, the reason, and
what to do. `examination` measures, and has the order.

Up to the way back the doctor needs neither rospy nor a node of its own: a question is an XML-RPC
call that only reads. Then it listens to the robot, as an ordinary node that publishes nothing.
"""
