"""Both ends of `ctrl_relinq` (std_msgs/Bool): True gives move_to_goal control, False takes it.

move_to_goal publishes on `has_control` whether it has control. So a sender learns whether its True
counts, and other nodes learn that control was given.
"""
import rospy
from std_msgs.msg import Bool

from tb3_labs.ros.rospy_internals import heard_by, messages_written
from tb3_labs.ros.topics import subscribe_events
from tb3_labs.supervision.permission import RENEWAL

#: The header of a sender's connections has this entry if the sender renews its permission. If
#: such a sender dies, the permission expires, even before the first renewal.
RENEWS = {'renewed': '1'}


class ControlGiver:
    """The sender's end: it gives control, renews it and takes it. The gamepad uses it.

    `prefix` is the robot's namespace with a slash, such as robot3/; '' means this node's own.
    """

    def __init__(self, prefix=''):
        self._publisher = rospy.Publisher(prefix + 'ctrl_relinq', Bool, queue_size=20, latch=True,
                                          headers=RENEWS)
        self._said_at = 0.0

    @property
    def takers(self):
        """Names of the nodes that hear this sender."""
        return heard_by(self._publisher)

    @property
    def written(self):
        """{connection: number of messages written to it}."""
        return messages_written(self._publisher)

    def say(self, word, now):
        """Publish `word`: True once, or False twice. `now` is the steady_time() [s].

        A listener may take the first message on a connection for a latched one. A stop must count
        there, too, so it is sent twice.
        """
        self._said_at = now
        for _ in range(1 if word else 2):
            self._publisher.publish(word)

    def renew(self, now):
        """Publish True again if RENEWAL [s] has passed since the last message, see :meth:`say`."""
        if now - self._said_at >= RENEWAL:
            self.say(True, now)


def hear_takers(on_taken):
    """Call `on_taken()` when another node publishes False."""
    def hear(event):
        if not event.value.data and event.sender != rospy.get_name():
            on_taken()

    subscribe_events('ctrl_relinq', Bool, hear)


class ControlTaker:
    """move_to_goal's end: hears the permissions of all senders, and says whether it has control."""

    def __init__(self):
        self._has_control = None
        self._publisher = rospy.Publisher('has_control', Bool, queue_size=20, latch=True)

    def hear(self, told):
        """Call `told(granted, **details)` for each message; see permission.Permission.told."""
        def hear(event):
            told(event.value.data, sender=event.sender, is_doubtful=event.is_doubtful,
                 is_old=event.is_old, renews=RENEWS.items() <= event.header.items())

        subscribe_events('ctrl_relinq', Bool, hear)

    def say(self, has_control):
        """Publish whether move_to_goal has control, if that has changed."""
        if has_control != self._has_control:
            self._has_control = has_control
            self._publisher.publish(has_control)
