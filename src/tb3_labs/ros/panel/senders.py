"""What a page sends to the nodes of one robot: on the topics that other senders use as well."""
import math

import rospy
from geometry_msgs.msg import PoseStamped, Twist
from sensor_msgs.msg import Joy
from std_msgs.msg import Bool, Float64

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.msg import MouseController
from tb3_labs.nodes.pad_config import PadConfig
from tb3_labs.panel.joy import joy_of
from tb3_labs.ros.conversions import frame, to_pose_stamped
from tb3_labs.ros.ctrl_relinq import ControlGiver
from tb3_labs.ros.parameters import read_config
from tb3_labs.ros.rospy_internals import heard_by, messages_written


class Senders:
    """The publishers of one robot; `prefix` is its namespace with a slash, or ''.

    Only making them, and :meth:`read_pad_numbers`, wait for the master.
    """

    def __init__(self, prefix):
        self._prefix = prefix
        self._pad_config = PadConfig()
        self._control = ControlGiver(prefix)
        # nodes that hear stops, and that no stop is for
        self._others = {rospy.get_name()} | {
            rospy.resolve_name(prefix + name) for name in ('gamepad', 'controller')}
        self._has_said = False           # any word on ctrl_relinq
        self._joy = rospy.Publisher(prefix + 'joy', Joy, queue_size=20, tcp_nodelay=True)
        self._mouse = rospy.Publisher(prefix + 'mouse_info', MouseController, queue_size=20,
                                      tcp_nodelay=True)
        self._turn = rospy.Publisher(prefix + 'turn', Float64, queue_size=5)
        self._goal = rospy.Publisher(prefix + 'move_base_simple/goal', PoseStamped, queue_size=5)
        self._cmd_vel = rospy.Publisher(prefix + 'cmd_vel', Twist, queue_size=1, tcp_nodelay=True)

    def heard(self):
        """{what a page can ask for: does any node listen to it?}"""
        control, goal = self.takers, heard_by(self._goal)
        return {'goal': bool(goal), 'reset': bool(goal or control), 'control': bool(control),
                'turn': bool(heard_by(self._turn)), 'mouse': bool(heard_by(self._mouse)),
                'pad': bool(heard_by(self._joy) - {rospy.get_name()})}

    @property
    def takers(self):
        """Names of the nodes from which control can be taken."""
        return self._control.takers - self._others

    @property
    def stoppable(self):
        """Names of the nodes that hear a stop: those, and the robot's."""
        return self.takers | heard_by(self._cmd_vel) - self._others

    def words_written(self):
        """{connection: number of messages written to it}, of those on which control is taken,"""
        return self._control.written

    def stop_written(self):
        """and of all those by which a stop goes."""
        return {**self._control.written, **messages_written(self._cmd_vel)}

    def say(self, granted, now):
        """True gives control to move_to_goal, False takes it; `now` in [s], steady."""
        if granted and not self._has_said:
            # As a gamepad's first word: of a panel that was started again under its old name, a
            # True that comes first would count as one of the panel before.
            self._control.say(False, now)
        self._has_said = True
        self._control.say(granted, now)

    def renew(self, now):
        """Say True again, if that is due."""
        self._control.renew(now)

    def read_pad_numbers(self):
        """Learn the numbers of axes and buttons that the node gamepad uses now."""
        try:
            self._pad_config = read_config(PadConfig, of=rospy.resolve_name(
                self._prefix + 'gamepad'))
        except ValueError as problem:    # the node itself has refused them, and does not run
            rospy.logwarn('the pad has the usual numbers: %s', problem)
            self._pad_config = PadConfig()

    def pad(self, late_pad):
        """Publish a panel.wheel.LatePad as `joy`, as the package joy does."""
        axes, buttons = joy_of(late_pad.pad, self._pad_config)
        message = Joy(axes=axes, buttons=buttons)
        message.header.stamp = rospy.Time.from_sec(
            max(0.0, rospy.get_time() - late_pad.lateness))
        self._joy.publish(message)

    def mouse(self, state):
        """Publish a panel.wheel.MouseState as `mouse_info`, as mouse_client.py does."""
        message = MouseController(status=Bool(state.active), xPos=state.x, yPos=state.y)
        message.header.stamp = rospy.Time.now()
        self._mouse.publish(message)

    def turn(self, degrees):
        """Ask the controller for a turn [deg]."""
        self._turn.publish(degrees)

    def goal(self, place):
        """Send a goal, a panel.requests.Place."""
        self._goal.publish(to_pose_stamped(
            Pose2(place.x, place.y, math.radians(place.yaw_deg)), frame(self._prefix + 'local'),
            rospy.get_time()))

    def zero(self):
        """One zero velocity, for a robot that is driven by a node without any rule."""
        self._cmd_vel.publish(Twist())
