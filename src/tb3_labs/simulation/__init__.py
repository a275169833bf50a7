"""What would a robot do? The simulated TurtleBot3, part by part, its network, and its topics.

`simulator` joins the parts; `simulator_config` has their numbers, such as the firmware's delays;
`ros_robot` puts it on the topics of a real robot.
"""
