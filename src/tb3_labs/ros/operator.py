"""An operator's requests to move_to_goal: control, and a reset.

On `ctrl_relinq` (std_msgs/Bool) True gives control, False takes it. move_to_goal publishes on
`has_control` whether it has control, so a sender learns whether its True counts. The other side is
:mod:`tb3_labs.ros.control_and_reset`.

A reset is a call of a service. A node of this package offers `reset_pose`, which says why a reset
is refused. A node as in the handout offers only `set_pose`.
"""
import rosgraph
import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped
from std_msgs.msg import Bool

from tb3_labs.geometry.se2 import TypedPose
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.conversions import to_pose_stamped
from tb3_labs.ros.topics import RENEWS, subscribe_events
from tb3_labs.srv import ResetPose, SetInitialPose
from tb3_labs.supervision.freshness import RENEWAL

#: Longest wait until a service is offered (WAIT), and for the connection to it (CONTACT) [s].
WAIT, CONTACT = 1.0, 0.5
#: The covariance in the handout. The service was AMCL's at first, and AMCL requires a covariance.
COVARIANCE = 36 * [0.1]


class ControlSender:
    """A sender's side of `ctrl_relinq`: it gives control, renews it and takes it."""

    def __init__(self):
        self._publisher = rospy.Publisher('ctrl_relinq', Bool, queue_size=20, latch=True,
                                          headers=RENEWS)
        self._said_at = 0.0

    def say(self, word, now):
        """Publish `word`: True once, or False twice. `now` is the steady_time() [s].

        A listener may take the first message on a connection for a latched one. A stop must count
        there, too, so it is sent twice.
        """
        self._said_at = now
        for _ in range(1 if word else 2):
            self._publisher.publish(word)

    def renew(self, now):
        """Say True again if RENEWAL [s] has passed since the last message."""
        if now - self._said_at >= RENEWAL:
            self.say(True, now)


def hear_takers(on_taken):
    """Call `on_taken()` when another node publishes False."""
    def hear(event):
        if not event.what and event.sender != rospy.get_name():
            on_taken()

    subscribe_events('ctrl_relinq', Bool, hear)


def call_reset(x, y, yaw_deg):
    """Declare the robot to be at x, y [m], yaw [deg] in local. Returns the answer in words;
    ``ValueError`` with the reason of a refusal."""
    own, handout = (rospy.resolve_name(name) for name in ('reset_pose', 'set_pose'))
    try:
        if _first_offered(own, handout) == handout:
            pose = TypedPose(x, y, yaw_deg).pose
            rospy.ServiceProxy(handout, SetInitialPose)(_stamped(pose))
            return '{} was called with {}'.format(handout, pose)
        response = rospy.ServiceProxy(own, ResetPose)(x, y, yaw_deg)
    except (rospy.ROSException, rospy.ServiceException) as problem:
        raise ValueError(str(problem)) from None
    if not response.success:
        raise ValueError(response.message)
    return response.message


def _first_offered(*services):
    """Returns the first service that answers; ``ValueError`` if none answers within WAIT."""
    found = ''

    def look():
        nonlocal found
        found = next(filter(_answers, services), '')
        return found
    if not wait_until(look, WAIT):
        raise ValueError('no node offers ' + ' or '.join(services))
    return found


def _answers(service):
    try:
        # wait_for_service() alone would sleep for 0.3 s if the master does not know the service
        rosgraph.Master(rospy.get_name()).lookupService(service)
        rospy.wait_for_service(service, CONTACT)
    except (OSError, rosgraph.MasterException, rospy.ROSException):
        return False
    return True


def _stamped(pose):
    """The geometry_msgs/PoseWithCovarianceStamped of a Pose2, as the handout's gamepad sends it."""
    plain = to_pose_stamped(pose, 'map', rospy.get_time())
    message = PoseWithCovarianceStamped(header=plain.header)
    message.pose.pose, message.pose.covariance = plain.pose, COVARIANCE
    return message
