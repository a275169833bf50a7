"""The goal as RViz shows it: an arrow, the tolerance as a disc, the state in words."""
import rospy
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from tb3_labs.ros.conversions import to_pose_stamped

ORANGE = ColorRGBA(r=1.0, g=0.55, b=0.0, a=1.0)
PALE_ORANGE = ColorRGBA(r=1.0, g=0.55, b=0.0, a=0.35)
WHITE = ColorRGBA(r=1.0, g=1.0, b=1.0, a=1.0)


class GoalMarker:
    """Publishes `goal_marker` (latched), whenever goal or words change."""

    def __init__(self, frame):
        self._frame = frame
        self._publisher = rospy.Publisher('goal_marker', MarkerArray, queue_size=1, latch=True)

    def show(self, goal, tolerance, words):
        """Draw the Pose2 `goal` with its tolerance [m] and a line of text above it."""
        arrow = self._marker(0, Marker.ARROW, goal, ORANGE, (0.20, 0.03, 0.03))
        disc = self._marker(1, Marker.CYLINDER, goal, PALE_ORANGE,
                            (2.0 * tolerance, 2.0 * tolerance, 0.005))
        text = self._marker(2, Marker.TEXT_VIEW_FACING, goal, WHITE, (0.0, 0.0, 0.08))
        text.pose.position.z = 0.25
        text.text = words
        self._publisher.publish(MarkerArray(markers=[arrow, disc, text]))

    def _marker(self, number, kind, pose, color, scale):
        marker = Marker(type=kind, action=Marker.ADD, ns='goal', id=number, color=color)
        stamped = to_pose_stamped(pose, self._frame, 0.0)
        marker.header, marker.pose = stamped.header, stamped.pose
        marker.scale.x, marker.scale.y, marker.scale.z = scale
        return marker
