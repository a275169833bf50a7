"""What is wrong with this computer, its network or a robot? Measured without rospy, said in lines.

A look measures numbers and names; a function ``judge_*`` turns them into one line: ok, warning or
fault, the reason, and what to do. No judgement raises: without numbers its line says so.

Nothing here registers at the master, publishes, or changes anything: a question is an XML-RPC call
that only reads, and listening is a connection to the publisher itself. So the doctor works where
rospy cannot be imported or would wait. Every question has a deadline: neither the resolver of names
nor a slow peer holds the doctor up.
"""
