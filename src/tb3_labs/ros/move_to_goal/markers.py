"""Markers for RViz.

The goal as an arrow, the tolerance as a disc, the line to the goal, the state above the robot.
"""
import threading
import time

import rospy
from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.ros.conversions import to_pose_stamped

#: Markers are sent again after this time [s, wall clock].
REPEAT_PERIOD = 1.0

ORANGE = ColorRGBA(r=1.0, g=0.55, b=0.0, a=1.0)
PALE_YELLOW = ColorRGBA(r=1.0, g=0.95, b=0.6, a=0.6)
WHITE = ColorRGBA(r=1.0, g=1.0, b=1.0, a=1.0)


class GoalMarker:
    """Publishes `goal_marker`, at once when goal or words change.

    It repeats it as well, since RViz drops markers whose frame it does not know yet.
    """

    def __init__(self, frame, robot_frame):
        self._frame = frame
        self._robot = robot_frame
        self._publisher = rospy.Publisher('goal_marker', MarkerArray, queue_size=1, latch=True)
        self._shown = MarkerArray()
        threading.Thread(target=self._run, name='goal_marker', daemon=True).start()

    def show(self, goal, tolerance, words):
        """Draw the Pose2 `goal` with its tolerance [m], and a line of text above the robot."""
        arrow = self._marker(0, goal, Marker.ARROW, ORANGE, (0.20, 0.03, 0.03))
        disc = self._marker(1, goal, Marker.CYLINDER, PALE_YELLOW,
                            (2.0 * tolerance, 2.0 * tolerance, 0.005))
        text = _marker('words', 2, self._robot, Pose2(), Marker.TEXT_VIEW_FACING, WHITE,
                       (0.0, 0.0, 0.1))
        disc.pose.position.z, text.pose.position.z = 0.02, 0.3
        text.text = words + 4 * '\n'    # centred: empty lines keep it off the robot
        self._shown = MarkerArray(markers=[arrow, disc, text])
        self._publisher.publish(self._shown)

    def _run(self):
        while not rospy.is_shutdown():
            time.sleep(REPEAT_PERIOD)
            try:
                self._publisher.publish(self._shown)
            except rospy.ROSException:  # closed: the node ends
                return

    def _marker(self, number, goal, *looks):
        return _marker('goal', number, self._frame, goal, *looks)


class WayMarker:
    """Publishes `way_marker`: the straight line from the robot to its goal."""

    def __init__(self, frame):
        self._line = _marker('way', 0, frame, Pose2(), Marker.LINE_STRIP, ORANGE, (0.012, 0.0, 0.0))
        self._publisher = rospy.Publisher('way_marker', Marker, queue_size=1)

    def show(self, pose, goal_of_drive):
        """Draw a line from a Pose2 to that of `goal_of_drive()`; nothing if it is None, or nobody
        hears."""
        if not self._publisher.get_num_connections():
            return
        goal = goal_of_drive()
        self._line.action = Marker.DELETE if goal is None else Marker.ADD
        if goal is not None:
            self._line.points = [Point(place.x, place.y, 0.005) for place in (pose, goal)]
        self._publisher.publish(self._line)


def _marker(namespace, number, frame, pose, kind, color, scale):
    """A marker that moves with its frame."""
    marker = Marker(type=kind, action=Marker.ADD, ns=namespace, id=number, color=color,
                    frame_locked=True)
    stamped = to_pose_stamped(pose, frame, 0.0)
    marker.header, marker.pose = stamped.header, stamped.pose
    marker.scale.x, marker.scale.y, marker.scale.z = scale
    return marker
