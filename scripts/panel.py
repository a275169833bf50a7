#!/usr/bin/env python3
"""Shows the robot on a page in any browser. A person can drive the robot from the page.

The panel prints the page's address. A page plays a gamepad or a mouse, so the node `gamepad` or the
node `controller` must run. Only one page can drive at a time. Every page can stop the robot.

Subscribes
    imu, odom, cmd_vel, joy, local_pose, goal_state, current_goal, has_control, control_holder,
    ground_truth, /tf, /tf_static, /rosout, variables, ctrl_relinq, move2goal/cancel
Publishes, when a person asks for it on a page
    joy                     sensor_msgs/Joy: the page's pad, with the numbers that gamepad uses
    mouse_info              tb3_labs/MouseController: the page's mouse
    turn                    std_msgs/Float64 [deg]
    move_base_simple/goal   geometry_msgs/PoseStamped, frame local
    ctrl_relinq             std_msgs/Bool: False for each stop
    cmd_vel                 geometry_msgs/Twist: one zero for each stop
Calls
    reset_pose              tb3_labs/ResetPose
    set_pose                tb3_labs/SetInitialPose, if no node offers reset_pose
Parameters
    ~port, ~address, ~control, ...: see PanelConfig in tb3_labs.panel.access
    ~model or TURTLEBOT3_MODEL in the environment: burger, waffle, waffle_pi
"""
import tb3_labs.ros.early_signals    # noqa: F401 (first, so that Ctrl+C works in later imports)

import rospy

from tb3_labs.panel.access import PanelConfig
from tb3_labs.panel.ros_pages import Pages
from tb3_labs.ros.node import run_node
from tb3_labs.ros.parameters import read_config, read_model


def offer_pages():
    """Offer the page and print its address."""
    config = read_config(PanelConfig)
    pages = Pages(config, read_model().body_radius)
    rospy.on_shutdown(pages.release)
    # the address is not logged, because anyone can drive with the token in it
    restriction = '' if config.control else ' (it only shows)'
    print(f'Panel: open {pages.address} in a browser{restriction}')
    return pages


if __name__ == '__main__':
    run_node('panel', offer_pages, __doc__)
