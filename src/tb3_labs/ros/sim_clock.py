"""Simulated time that never comes, or stands still: said loudly, and no robot moves by it.

With wall time there is nothing to watch, and no thread.
"""
import threading
import time

import rospy

#: A clock that never came is spoken of after this time, and then every so often [s, wall clock].
FIRST_WARNING = 2.0
NEXT_WARNING = 10.0
#: A clock that says the same for this long stands still [s, wall clock].
STANDSTILL = 0.3
PERIOD = 0.05


def say_if_no_clock_comes():
    """Start to wait for /clock, in a thread of its own; every node does."""
    if not rospy.rostime.is_wallclock():
        threading.Thread(target=_wait_for_clock, name='clock', daemon=True).start()


def _wait_for_clock():
    due = time.monotonic() + FIRST_WARNING
    while rospy.get_time() == 0.0 and not rospy.is_shutdown():
        if time.monotonic() >= due:
            due += NEXT_WARNING
            rospy.logerr('/use_sim_time is true, but nobody publishes /clock: start a simulation, '
                         'or: rosparam set /use_sim_time false, and start the nodes again')
        time.sleep(PERIOD)


class ClockWatch:
    """Knows whether ROS time runs; `on_standstill()` is called when it stops."""

    def __init__(self, on_standstill):
        self._on_standstill = on_standstill
        #: False while there is no time to drive by.
        self.runs = rospy.rostime.is_wallclock()
        if not self.runs:
            threading.Thread(target=self._watch, name='clock_watch', daemon=True).start()

    def _watch(self):
        last, changed_at = 0.0, -STANDSTILL
        while not rospy.is_shutdown():
            now = rospy.get_time()
            if now != last:
                last, changed_at = now, time.monotonic()
            runs = time.monotonic() - changed_at < STANDSTILL
            stopped, self.runs = self.runs and not runs, runs
            if stopped:
                self._on_standstill()
                rospy.logwarn('/clock stands still: nothing is driven until it goes on')
            time.sleep(PERIOD)
