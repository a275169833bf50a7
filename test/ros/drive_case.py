"""Shared by the tests that send move_to_goal to goals: control, goals, resets, and states."""
import math

import rospy
from geometry_msgs.msg import PoseStamped
from std_msgs.msg import Bool, String

from node_case import STARTING, NodeCase
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.ros.conversions import to_pose_stamped
from tb3_labs.srv import ResetPose


class DriveCase(NodeCase):
    """A case that sends move_to_goal to goals, gives it control and takes it back."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.watch_data(String, 'goal_state')
        cls.control = rospy.Publisher('ctrl_relinq', Bool, queue_size=5)    # each word counts
        cls.goals = rospy.Publisher('move_base_simple/goal', PoseStamped, queue_size=10)
        cls.reset = rospy.ServiceProxy('reset_pose', ResetPose)

    def declare(self, pose=Pose2()):
        """Reset the local pose to `pose`. A refused reset is repeated, since a busy machine delays the sensors.
        Returns the last answer."""
        answers = []

        def is_declared():
            answers.append(self.reset(pose.x, pose.y, math.degrees(pose.yaw)))
            return answers[-1].success
        self.observer.wait_until(is_declared, STARTING, 'a reset')
        return answers[-1]

    def give_control(self):
        """Give move_to_goal control. To a node that started after this test, a True alone may be a repetition."""
        for word in (False, True):
            self.control.publish(word)

    def go_to(self, goal, frame='local'):
        self.goals.publish(to_pose_stamped(goal, frame, 0.0))

    @classmethod
    def wait_for_state(cls, *states, seconds=20.0):
        """Wait until the state of the goal begins with one of `states`. Returns the state."""
        return cls.observer.wait_for('goal_state', lambda state: state.startswith(states), seconds)

    def wait_for_speed(self, linear, seconds=20.0):
        """Wait until more than this forward speed is commanded [m/s]."""
        self.observer.wait_for('cmd_vel', lambda command: command[0] > linear, seconds)
