"""Wakes a driving node while no message arrives."""
import math
import threading
import time

import rospy

from tb3_labs.ros.clocks import steady_time
from tb3_labs.ros.node import guarded

#: The watchdog of a node that reckons on with old samples begins to check when no message came for
#: this long [s, wall clock], half the shortest timeout,
QUIET_TIME = 0.1
#: and then checks with this period, until the next message [s].
CHECK_PERIOD = 0.02
#: A node that does not drive looks at the clock with this period, so that it notices a sleep [s].
IDLE_PERIOD = 0.1


class Watchdog:
    """Calls `check()`, guarded, in a thread of its own: often while it is awake and not fed.

    The thread begins with the first call of :meth:`keep`. A rospy.Timer would stop with the
    simulated clock, just when the check is needed.
    """

    def __init__(self, check, quiet_time=QUIET_TIME):
        self._check = guarded(check)
        self._quiet_time = quiet_time
        self._awake = threading.Event()
        self._fed_at = -math.inf
        self._thread = threading.Thread(target=self._run, name='watchdog', daemon=True)

    def keep(self, awake):
        """`awake`: the node drives, so it must be checked often. Called with the node's lock held.
        """
        if not self._thread.ident:
            self._thread.start()
        if awake is not self._awake.is_set():    # which is cheaper than to say it again
            (self._awake.set if awake else self._awake.clear)()

    def feed(self):
        """A message has arrived and was processed."""
        self._fed_at = steady_time()

    def _run(self):
        while not rospy.is_shutdown():
            is_awake = self._awake.wait(IDLE_PERIOD)
            patient_for = self._fed_at + self._quiet_time - steady_time()
            if is_awake and patient_for > 0.0:
                time.sleep(patient_for)
            else:
                self._check()
                if is_awake:
                    time.sleep(CHECK_PERIOD)
