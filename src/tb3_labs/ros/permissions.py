"""What the connection says of a permission: was it given before this node started, is it renewed?

`ctrl_relinq` is latched, and a gamepad renews it, so that a node which was killed in mid-drive and
is started again would drive off at once, to nobody's wish. What a sender had said before this node
came counts only from its next False on.
"""
import time

import rospy

#: By this in the header of its connections a sender says that it renews what it gives, so that it
#: lapses if the sender dies, even before the first renewal.
WILL_BE_RENEWED = {'renewed': '1'}
#: What was latched arrives within this time of the start [s].
CONNECTING = 1.0


def will_be_renewed(message):
    """Does the sender of a std_msgs/Bool renew what it gives?"""
    return WILL_BE_RENEWED.items() <= message._connection_header.items()


class OldPermissions:
    """Judges the messages of `ctrl_relinq`."""

    def __init__(self):
        self._started = time.monotonic()
        self._heard = set()       # senders so far,
        self._old = set()         # and those whose permission is older than this node

    def is_old(self, message):
        """Is this a std_msgs/Bool that was meant for somebody else?"""
        # rospy keeps the header of the connection with each message: who sent it, and how
        header = message._connection_header
        sender = header['callerid']
        is_first = sender not in self._heard
        self._heard.add(sender)
        if not message.data:
            self._old.discard(sender)
        elif is_first and header.get('latching') == '1' and (
                time.monotonic() - self._started < CONNECTING):
            self._old.add(sender)
            rospy.logwarn('Control was given by %s before this node started, and does not count: '
                          'take it back, then give it again', sender)
        return sender in self._old
