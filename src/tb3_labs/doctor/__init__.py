"""What is wrong with this computer, its network or a robot? Each check, without rospy, is a line.

A function ``look_at_*`` measures; a function ``judge_*`` turns numbers and names into one line: ok,
warning or fault, the reason, and what to do. A judgement raises no exception: if numbers are
missing, its line says so.

Nothing here registers at the master, publishes, or changes anything: a question is an XML-RPC call
that only reads, and listening is a connection to the publisher itself. So the doctor also works if
rospy cannot be imported, or would wait. Every question has a deadline: a name that resolves
slowly, or a slow peer, cannot block the doctor.
"""
