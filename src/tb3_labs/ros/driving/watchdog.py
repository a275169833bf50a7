"""Wakes a driving node while no message arrives."""
import math
import threading
import time

import rospy

from tb3_labs.ros.node import guarded

#: The watchdog of a node that reckons on with old samples begins to check when no message came for
#: this long [s, wall clock], half the shortest timeout,
QUIET_TIME = 0.1
#: and then checks with this period, until the next message [s].
CHECK_PERIOD = 0.02


class Watchdog:
    """Calls `check()`, guarded, in a thread of its own, while it is awake and not fed.

    A rospy.Timer would stop with the simulated clock, just when the check is needed.
    """

    def __init__(self, check, quiet_time=QUIET_TIME):
        self._check = guarded(check)
        self._quiet_time = quiet_time
        self._awake = threading.Event()
        self._fed_at = -math.inf
        threading.Thread(target=self._run, name='watchdog', daemon=True).start()

    def keep(self, awake):
        """`awake`: the node drives, so it must be checked."""
        if awake is not self._awake.is_set():    # which is cheaper than to say it again
            (self._awake.set if awake else self._awake.clear)()

    def feed(self):
        """A message has arrived and was processed."""
        self._fed_at = time.monotonic()

    def _run(self):
        while not rospy.is_shutdown():
            self._awake.wait()
            patient_for = self._fed_at + self._quiet_time - time.monotonic()
            if patient_for > 0.0:
                time.sleep(patient_for)
            else:
                self._check()
                time.sleep(CHECK_PERIOD)
