"""What would a robot do? The simulated TurtleBot3, part by part, its network, and its topics.

`firmware` is the board, `body` the motors, wheels and the IMU. `sensors` makes the samples,
`network` delays and stalls messages, `mystery_robot` hides a fault. `simulator` joins these parts.
`simulator_config` has their settings, `ros_fake_robot` publishes the topics of a real robot, and
`mystery_answer` judges an answer.
"""
