#!/usr/bin/env python3
"""Drives to a goal in a local frame. The frame can be reset while the robot drives.

Subscribes
    imu                    sensor_msgs/Imu
    odom                   nav_msgs/Odometry
    joint_states           sensor_msgs/JointState, optional: do gyro and wheels agree?
    cmd_vel                geometry_msgs/Twist: did any node move the robot?
    ctrl_relinq            std_msgs/Bool: True = this node may drive (see
                           tb3_labs.supervision.permission)
    move_base_simple/goal  geometry_msgs/PoseStamped: a goal
    initialpose            geometry_msgs/PoseWithCovarianceStamped: a reset
Publishes
    cmd_vel                geometry_msgs/Twist, only while driving, and then one zero
    local_pose             geometry_msgs/PoseStamped, frame local, with each odometry message, while
                           a node listens
    local_path             nav_msgs/Path, frame local
    has_control            std_msgs/Bool, latched: was control given, and not taken back?
    goal_state             std_msgs/String, latched: the state, or the reason why a drive failed
    current_goal           geometry_msgs/PoseStamped, frame local, latched
    goal_marker            visualization_msgs/MarkerArray
    /tf                    odom -> local, ten times a second, and at each reset
    /diagnostics
Services
    reset_pose             tb3_labs/ResetPose [m, deg]: the robot's present pose in local
    set_pose               tb3_labs/SetInitialPose: the same reset with the handout's type
Action
    move2goal              move_base_msgs/MoveBaseAction
Parameters
    ~goal_x, ~goal_y [m], ~goal_yaw_deg: see MoveToGoalConfig in tb3_labs.nodes.move_to_goal.status
    _has_control:=true: the node may drive at once; this is no ROS parameter, since a parameter
    would outlive the node
    ~allow_reverse, tolerances and limits: see DriveConfig in tb3_labs.control.drive_law;
    they may change while the node runs: dynparam set /move_to_goal max_linear 0.1
    ~model or TURTLEBOT3_MODEL in the environment: burger, waffle, waffle_pi
"""
import tb3_labs.ros.early_signals    # noqa: F401 (first, so that Ctrl+C works in later imports)
from tb3_labs.nodes.move_to_goal.ros_node import MoveToGoalNode, pop_permission
from tb3_labs.ros.node import run_node

if __name__ == '__main__':
    typed_control = pop_permission()
    run_node('move_to_goal', lambda: MoveToGoalNode(typed_control), __doc__)
