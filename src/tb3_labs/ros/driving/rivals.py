"""Notices that another node drives the robot at the same time, and names it."""
import threading
import time
from collections import defaultdict, deque

import rospy
from geometry_msgs.msg import Twist

from tb3_labs.ros.rospy_internals import connection_of, stop_hearing_oneself
from tb3_labs.ros.topics import subscribe

#: A node that sends this many commands within this time [s], while this one drives, is a rival.
FIGHT = 3
FIGHT_TIME = 1.0
#: Commands in the first moment of driving [s] do not count: another node may just have stopped.
FIRST_MOMENT = 0.3
#: Time between two warnings of the same rival [s].
WARNING_PERIOD = 10.0


class Rivals:
    """Listens on `cmd_vel` beside the CmdVel that this node drives by."""

    def __init__(self, cmd_vel, heard=lambda command: None):
        """`heard(Twist)` is called with each command of another node."""
        self._cmd_vel = cmd_vel
        self._heard = heard
        self._lock = threading.Lock()    # guards the next two; each rival has a thread of its own
        self._seen = defaultdict(lambda: deque(maxlen=FIGHT))   # times of each node's commands
        self._warned = {}
        self._commands = subscribe('cmd_vel', Twist, self._on_command)

    @property
    def complaint(self):
        """The names of the other drivers in words; '' if there are none."""
        with self._lock:
            rivals = [name for name, times in self._seen.items() if self._is_rival(times)]
        return 'also driven by ' + ', '.join(sorted(rivals)) if rivals else ''

    def _on_command(self, message):
        sender = connection_of(message)['callerid']
        if sender == rospy.get_name():
            stop_hearing_oneself(self._commands)
            return
        self._heard(message)
        if self._cmd_vel.driving_for >= FIRST_MOMENT and self._is_to_be_named(sender):
            rospy.logwarn('%s sends commands while %s drives: stop one of them', sender,
                          rospy.get_name())

    def _is_to_be_named(self, sender):
        now = time.monotonic()
        with self._lock:
            self._seen[sender].append(now)
            if not self._is_rival(self._seen[sender]) or (
                    now - self._warned.get(sender, -WARNING_PERIOD) < WARNING_PERIOD):
                return False
            self._warned[sender] = now
            return True

    @staticmethod
    def _is_rival(times):
        return len(times) == FIGHT and time.monotonic() - times[0] <= 2.0 * FIGHT_TIME and (
            times[-1] - times[0] <= FIGHT_TIME)
