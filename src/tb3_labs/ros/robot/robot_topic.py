"""A topic on which an embedded robot publishes: written at once, by the robot's own thread."""
from weakref import WeakKeyDictionary

import rospy

from tb3_labs.ros.rospy_internals import publish_together, write_in_this_thread
from tb3_labs.ros.robot.outbox import Outbox


class RobotTopic:
    """A publisher that waits for no subscriber.

    rospy's queues give each subscriber a thread, which each message wakes: half of what a robot
    costs. Without a queue, publish() waits for a subscriber that does not read, and the robot would
    stand still. Here neither happens. `publish` is called by one thread.
    """

    def __init__(self, name, kind):
        self._publisher = rospy.Publisher(name, kind, queue_size=1, tcp_nodelay=True)
        write_in_this_thread(self._publisher)
        self._outboxes = WeakKeyDictionary()    # by a subscriber's socket

    @property
    def is_heard(self):
        """Does any node listen?"""
        return self._publisher.get_num_connections() > 0

    def publish(self, *messages):
        """Send the messages, by one write to each subscriber: a network delivers delayed messages
        in this way. A subscriber that does not read gets none once its outbox is full."""
        publish_together(self._publisher, messages, self._write)

    def _write(self, socket, data):
        return self._outboxes.setdefault(socket, Outbox(socket)).send(data)
