"""The hand on the mouse of the IMU lab, by whatever message the node itself uses."""
import rospy

from tb3_labs.marking.topics import MOUSE_INFO
from tb3_labs.msg import MouseController
from tb3_labs.ros.marking.hand import Hand


class Mouse(Hand):
    """The mouse on the topic mouse_info.

    AttributeError if the node's message does not have the fields of tb3_labs/MouseController.
    """

    def __init__(self, graph):
        """`graph`: the Graph of the node that runs."""
        self._kind = graph.kind_of(MOUSE_INFO) or MouseController
        self._message_at(0.0, 0.0, False)    # raises here, not in the middle of a stimulus
        super().__init__(MOUSE_INFO, self._kind)

    def at(self, x, y, active=True):
        """Hold it there: x to the right, y up, each -1 to 1."""
        self.hold(self._message_at(x, y, active))

    def _message_at(self, x, y, active):
        message = self._kind()
        message.header.stamp = rospy.Time.now()
        message.status.data = active
        message.xPos, message.yPos = x, y
        return message


def mouse_of(stage, names):
    """The Mouse of the node, held inactive in the middle; None if the node listens to none, and
    then these stimuli are not offered."""
    if not stage.node.graph.listens_to(MOUSE_INFO):
        stage.not_offered(names, 'it does not listen to mouse_info')
        return None
    try:
        mouse = Mouse(stage.node.graph)
    except AttributeError as problem:
        stage.not_offered(names, 'its message on mouse_info has other fields: {}'.format(problem))
        return None
    mouse.at(0.0, 0.0, active=False)
    mouse.wait_until_heard()
    return mouse
