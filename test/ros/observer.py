"""Keeps what other nodes publish."""
import threading
import time
from collections import deque
from itertools import takewhile

import rospy

from tb3_labs.geometry.angles import difference
from tb3_labs.ros.rospy_internals import join_publisher_lists
from tb3_labs.ros.topics import subscribe

#: Number of messages kept of each topic: enough for minutes, not for hours.
KEPT_MESSAGES = 20000
#: A pose that rests moves by less than this in STILL_TIME [m].
STILL_WAY = 1e-5
#: A pose that rests turns by less than this in STILL_TIME [rad].
STILL_TURN = 1e-5
#: Time over which a pose is compared with itself [s].
STILL_TIME = 0.3


class Observer:
    """Keeps the messages of the topics it watches, and waits for conditions.

    Times of arrival are ROS time [s]. Deadlines are wall time, since a clock may stand still.
    """

    def __init__(self):
        join_publisher_lists()    # a test starts together with its robot
        self._changed = threading.Condition(threading.RLock())
        self._seen = {}

    def watch(self, topic, kind, read=None):
        """Keep the messages of `topic`. `read` turns a message into the value that is kept."""
        self._seen[topic] = deque(maxlen=KEPT_MESSAGES)

        def keep(value):
            with self._changed:
                self._seen[topic].append((rospy.get_time(), value))
                self._changed.notify_all()
        # with a shorter queue, one of two messages that arrive at once would be dropped
        subscribe(topic, kind, keep, read, queue_size=KEPT_MESSAGES)

    def all(self, topic, since=float('-inf')):
        """Returns [(time, value)] of the messages from the time `since` on. If the clock jumped
        back, the messages before the jump are left out."""
        with self._changed:
            # search from the end: a wait asks often for the last few of thousands of messages
            recent = list(takewhile(lambda entry: entry[0] >= since, reversed(self._seen[topic])))
        return recent[::-1]

    def latest(self, topic):
        """The latest value, or None."""
        with self._changed:
            return self._seen[topic][-1][1] if self._seen[topic] else None

    def forget(self, topic):
        with self._changed:
            self._seen[topic].clear()

    def wait_for(self, topic, condition=lambda value: True, seconds=20.0):
        """Returns the latest value of `topic` as soon as it fulfils `condition`. Raises
        RuntimeError after `seconds` of wall time."""
        return self.wait_until(
            lambda: self._seen[topic] and condition(self._seen[topic][-1][1]),
            seconds, topic) and self.latest(topic)

    def wait_for_rest(self, topic, pose_of=lambda value: value, seconds=20.0):
        """Wait until the poses on `topic` rest. `pose_of` reads a Pose2 from a value."""
        def rests():
            recent = [pose_of(value) for _, value in self.all(topic, rospy.get_time() - STILL_TIME)]
            return len(recent) > 5 and recent[0].distance_to(recent[-1]) < STILL_WAY and abs(
                difference(recent[-1].yaw, recent[0].yaw)) < STILL_TURN
        self.wait_until(rests, seconds, 'rest on ' + topic)

    def wait_until(self, condition, seconds=20.0, what='a condition'):
        """Wait until `condition()` holds. Raises RuntimeError after `seconds` of wall time."""
        deadline = time.monotonic() + seconds
        with self._changed:
            while not condition():
                left = deadline - time.monotonic()
                if left <= 0.0:
                    raise RuntimeError('waited {:.0f} s in vain for {}; last seen: {}'.format(
                        seconds, what, {topic: seen[-1][1] for topic, seen in self._seen.items()
                                        if seen and topic in (what, 'goal_state')}))
                self._changed.wait(min(left, 0.05))
        return True
