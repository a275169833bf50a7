"""What would a robot do? The simulated TurtleBot3, part by part, its network, and its topics.

`firmware` is the board, `body` the motors and wheels, `sensors` makes the samples, `network` delays
and stalls messages, `mystery_robot` hides a fault. `simulator` joins these parts;
`simulator_config` has their numbers, such as the firmware's delays; `ros_fake_robot` puts it on the
topics of a real robot, `mystery_answer` judges an answer.
"""
