#!/usr/bin/env python3
"""Turns the robot by keyboard with IMU feedback, and drives it by a mouse (the IMU lab).

Type l (90 degrees left), r (90 degrees right), b (180 degrees), a number of degrees (positive is
left), or q (quit), and press Enter.

Subscribes
    imu           sensor_msgs/Imu
    joint_states  sensor_msgs/JointState, optional: do gyro and wheels agree?
    turn          std_msgs/Float64 [deg], left positive: for scripts, in place of the keyboard
    mouse_info    tb3_labs/MouseController, from mouse_client.py
Publishes
    cmd_vel       geometry_msgs/Twist, only while turning or driven by the mouse, and then one zero
    /diagnostics
Parameters
    ~max_ang_z, ~tolerance_deg, ...: see TurnConfig in tb3_labs.nodes.controller.turns; they may
    change while the node runs: dynparam set /controller max_ang_z 1.0
    ~model or TURTLEBOT3_MODEL in the environment: burger, waffle, waffle_pi
"""
import tb3_labs.ros.early_signals    # noqa: F401 (first, so that Ctrl+C works in later imports)
from tb3_labs.nodes.controller.ros_node import ControllerNode
from tb3_labs.ros.node import run_node

if __name__ == '__main__':
    run_node('controller', ControllerNode, __doc__)
