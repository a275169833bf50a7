"""What would a robot do? This room simulates a TurtleBot3, its network, and its topics.

`firmware` is the board. `drivetrain` has the motors and the wheels, and `imu` has the IMU with
noise and bias. `sensors` makes the samples, `network` delays and stalls messages, and
`mystery_robot` hides a fault. `simulator` joins all parts, and `simulator_config` has all settings.
`ros_fake_robot` publishes the topics of a real robot.
"""
