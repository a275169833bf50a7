"""What would a robot do? This room simulates a TurtleBot3, its network, and its topics.

`firmware` simulates the board, `drivetrain` the motors and wheels, and `imu` the IMU with noise and
bias. `sensors` makes the samples, `network` delays messages, and `mystery_robot` hides a fault.
`simulator` joins all parts, `simulator_config` has the settings, `ros_fake_robot` the topics.
"""
