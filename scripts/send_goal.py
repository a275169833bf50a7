#!/usr/bin/env python3
"""Sends a goal in the local frame to move_to_goal, and prints the drive's states and result.

Usage: send_goal.py X Y YAW_DEG    [m, m, deg]
       send_goal.py 1 1 90         for example

Ctrl+C or a closed terminal cancels the goal. The exit status is 0 only if the robot reached the
goal.

Calls
    move2goal        move_base_msgs/MoveBaseAction
Subscribes
    goal_state       std_msgs/String: each new text is printed
"""
import tb3_labs.ros.early_signals    # noqa: F401 (first, so that Ctrl+C works in later imports)

import sys
import threading

import actionlib
import rospy
from actionlib_msgs.msg import GoalStatus
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from std_msgs.msg import String

from tb3_labs.command_line import number_or_text
from tb3_labs.control.goal_state import WAITING_FOR_CONTROL, is_over
from tb3_labs.ros.conversions import to_pose_stamped
from tb3_labs.ros.node import Interrupted, catch_signals, interruptible_sleep
from tb3_labs.ros.topics import require_master, subscribe
from tb3_labs.supervision.goal_requests import TypedPose
from tb3_labs.safe_output import run_tool

HELP = ('usage: send_goal.py X Y YAW_DEG, three numbers in m, m and degrees with blanks between '
        'them, such as: 1 1 90')
SERVER_TIMEOUT = 2.0          # [s]
SHUTDOWN_POLL_PERIOD = 2.0    # [s]


def print_states():
    """Print each new `goal_state`. The latched state of an earlier goal is not printed."""
    has_printed, last_line = False, ''

    def on_state(message):
        nonlocal has_printed, last_line
        line = message.data
        is_of_earlier_goal = not has_printed and is_over(line)
        if line == last_line or is_of_earlier_goal:
            return
        has_printed, last_line = True, line
        if line == WAITING_FOR_CONTROL:
            line += f': rostopic pub -1 {rospy.resolve_name("ctrl_relinq")} std_msgs/Bool true'
        print(line, flush=True)
    subscribe('goal_state', String, on_state, queue_size=None)


def drive(goal):
    """Send the goal, and wait until the drive ends. Returns the exit status. A signal cancels the
    goal."""
    rospy.init_node('send_goal', anonymous=True, disable_signals=True)
    # SimpleActionClient (1.14.0) would lose an answer that comes before send_goal() returns
    client = actionlib.ActionClient('move2goal', MoveBaseAction)
    if not client.wait_for_server(rospy.Duration(SERVER_TIMEOUT)):
        print(f'send_goal: {rospy.resolve_name("move2goal")} does not answer: is move_to_goal '
              'running?', file=sys.stderr)
        return 1

    ended = threading.Event()

    def on_transition(handle):
        if handle.get_comm_state() == actionlib.CommState.DONE:
            ended.set()

    goal_handle = client.send_goal(
        MoveBaseGoal(target_pose=to_pose_stamped(goal, 'local', 0.0)), on_transition)

    def cancel_unless_ended():
        if not ended.is_set():
            goal_handle.cancel()
    rospy.on_shutdown(cancel_unless_ended)
    try:
        print_states()
        while not ended.is_set():
            interruptible_sleep(0.0)    # raises Interrupted again if rospy caught the first one
            ended.wait(SHUTDOWN_POLL_PERIOD)
            if rospy.is_shutdown():
                return 1
    except Interrupted:
        goal_handle.cancel()
        ended.wait(SERVER_TIMEOUT)    # until move_to_goal reports that the goal is canceled
        raise
    print(goal_handle.get_goal_status_text())
    return 0 if goal_handle.get_goal_status() == GoalStatus.SUCCEEDED else 1


def main(argv):
    """Carry out the command line. Returns the exit status."""
    if argv in (['-h'], ['--help']):
        print(__doc__.strip())
        return 0
    numbers = [number_or_text(word) for word in argv if word != '--']
    try:
        if len(numbers) != 3:
            raise ValueError(HELP)
        goal = TypedPose(*numbers).pose
        require_master()
    except ValueError as error:
        print(f'send_goal: {error}', file=sys.stderr)
        return 2
    catch_signals()    # from here on Ctrl+C, `kill` and a closed terminal raise Interrupted
    try:
        return drive(goal)
    except Interrupted:
        return 1


if __name__ == '__main__':
    # without run_tool(), the error of a closed terminal would hide the exception Interrupted
    run_tool(lambda _: main(rospy.myargv()[1:]))
