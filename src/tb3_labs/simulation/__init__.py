"""What would a robot do? The simulated TurtleBot3, part by part, its network, and its topics.

`simulator` joins the parts; `ros_robot` puts it on the topics of a real robot.
"""
