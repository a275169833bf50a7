#!/usr/bin/env python3
"""Drives the robot by a gamepad, hands the robot over to move_to_goal, and resets the local frame.

The left stick drives (up and down), and the right stick turns (left and right). A lets move_to_goal
drive. B takes the robot back. Y declares that the robot is at (0, 0, 0) in the local frame.

Subscribes
    joy             sensor_msgs/Joy, best with autorepeat (gamepad.launch)
    ctrl_relinq     std_msgs/Bool: a False of another node takes control from move_to_goal
    has_control     std_msgs/Bool: has any node given control to move_to_goal?
Publishes
    cmd_vel         geometry_msgs/Twist, only while a stick is off its middle, and then one zero
    ctrl_relinq     std_msgs/Bool, latched: True = move_to_goal may drive, renewed while this pad
                    gives control; False at each press of B
    control_holder  std_msgs/String, latched: gamepad, move_to_goal or nobody
    /diagnostics
Calls
    reset_pose      tb3_labs/ResetPose
    set_pose        tb3_labs/SetInitialPose, if no node offers reset_pose
Parameters
    ~linear_axis, ~angular_axis, ~relinquish_button, ...: see PadConfig in
        tb3_labs.nodes.gamepad.pad
    ~model or TURTLEBOT3_MODEL in the environment: burger, waffle, waffle_pi
"""
import tb3_labs.ros.early_signals    # noqa: F401 (first, so that Ctrl+C works in later imports)
from tb3_labs.nodes.gamepad.ros_node import GamepadNode
from tb3_labs.ros.node import run_node

if __name__ == '__main__':
    run_node('gamepad', GamepadNode, __doc__)
