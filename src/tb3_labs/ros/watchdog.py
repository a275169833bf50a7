"""Looks after a driving node while no message arrives to wake it."""
import threading
import time

import rospy

from tb3_labs.ros.node import guarded

#: Between two looks [s, wall clock].
PERIOD = 0.02


class Watchdog:
    """Calls `check()` every PERIOD of wall time while awake; sleeps for good while not.

    A rospy.Timer would stop with the simulated clock, just when nobody else is left to look.
    """

    def __init__(self, check):
        self._check = guarded(check)
        self._awake = threading.Event()
        threading.Thread(target=self._run, name='watchdog', daemon=True).start()

    def keep(self, awake):
        """True while there is a robot to look after, because it is being driven."""
        if awake:
            self._awake.set()
        else:
            self._awake.clear()

    def _run(self):
        while not rospy.is_shutdown():
            self._awake.wait()
            self._check()
            time.sleep(PERIOD)
