#!/usr/bin/env python3
"""Sends move_to_goal to a goal in the local frame and prints how it ended.

Usage: send_goal.py X Y YAW_DEG    [m, m, deg]; Ctrl+C cancels the goal

Calls
    move2goal    move_base_msgs/MoveBaseAction
"""
import math
import sys
import threading

import actionlib
import rospy
from actionlib_msgs.msg import GoalStatus
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.ros.conversions import to_pose_stamped

USAGE = 'usage: send_goal.py X Y YAW_DEG, three numbers in m, m and degrees, such as: 1 1 90'


def main(words):
    """Send the goal, wait for its end; the exit status."""
    try:
        x, y, yaw_deg = (float(word) for word in words if word != '--')
    except ValueError:
        print(USAGE, file=sys.stderr)
        return 2
    rospy.init_node('send_goal', anonymous=True)
    client = actionlib.SimpleActionClient('move2goal', MoveBaseAction)
    if not client.wait_for_server(rospy.Duration(5.0)):
        print('move_to_goal does not answer: is it running?', file=sys.stderr)
        return 1
    goal = Pose2(x, y, math.radians(yaw_deg))
    client.send_goal(MoveBaseGoal(target_pose=to_pose_stamped(goal, 'local', 0.0)))
    over = threading.Event()
    rospy.on_shutdown(lambda: over.is_set() or client.cancel_goal())
    if not client.wait_for_result():
        return 1
    over.set()
    print(client.get_goal_status_text())
    return 0 if client.get_state() == GoalStatus.SUCCEEDED else 1


if __name__ == '__main__':
    sys.exit(main(rospy.myargv()[1:]))
