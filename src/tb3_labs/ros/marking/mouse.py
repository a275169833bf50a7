"""The hand on the mouse of the IMU lab, by whatever message the node itself uses."""
import rospy

from tb3_labs.marking.mouse_message import mouse_fields
from tb3_labs.marking.topics import MOUSE_INFO
from tb3_labs.msg import MouseController
from tb3_labs.ros.marking.hand import Hand


class Mouse(Hand):
    """The mouse on the topic mouse_info; ValueError if the node's message cannot hold one.

    `remarks` are sentences about fields whose names are not the handout's.
    """

    def __init__(self, graph):
        """`graph`: the Graph of the node that runs."""
        self._kind = graph.kind_of(MOUSE_INFO) or MouseController
        empty = self._kind()
        self._fields = mouse_fields(empty.__slots__, empty._slot_types)
        self.remarks = self._fields.remarks
        super().__init__(MOUSE_INFO, self._kind)

    def at(self, x, y, active=True):
        """Hold it there: x to the right, y up, each -1 to 1."""
        message = self._kind()
        if getattr(message, 'header', None) is not None:
            message.header.stamp = rospy.Time.now()
        for name, kind, value in zip(self._fields.names, self._fields.types, (active, x, y)):
            if '/' in kind:
                getattr(message, name).data = value
            else:
                setattr(message, name, value)
        self.hold(message)


def mouse_of(stage, names):
    """The Mouse of the node, held inactive in the middle; None if the node listens to none, and
    then these stimuli are not offered."""
    if not stage.node.graph.listens_to(MOUSE_INFO):
        stage.not_offered(names, 'it does not listen to mouse_info')
        return None
    try:
        mouse = Mouse(stage.node.graph)
    except ValueError as problem:
        stage.not_offered(names, str(problem))
        return None
    stage.remark(mouse.remarks)
    mouse.at(0.0, 0.0, active=False)
    mouse.wait_until_heard()
    return mouse
