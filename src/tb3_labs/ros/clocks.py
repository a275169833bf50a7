"""The clocks: which one counts for what; and simulated time that never comes, or stands still.

    rospy.get_time()   ROS time, simulated or not: the age of sensors, everything a robot drives by
    steady_time()      what is in people's hands: a pad, a mouse, a permission that is renewed
    time.monotonic()   deadlines of waits, pauses between warnings, the watchdog
    time.time()        only the moment at which the embedded robot's own time begins

A wait that nothing else ends is :func:`wait_until`; the Observer and the NodeProcess of
:mod:`tb3_labs.ros.testing` are woken by what arrives. Periodic work has a thread that sleeps by
the wall clock: ``rospy.sleep`` and ``rospy.Timer`` stop with a simulated one.
"""
import threading
import time

import rospy

from tb3_labs.ros.rospy_internals import is_wall_time

#: Until a clock that never came is reported first, and between later reports [s, wall clock].
FIRST_WARNING = 2.0
NEXT_WARNING = 10.0
#: A clock that says the same for this long stands still [s, wall clock].
STANDSTILL = 0.3
#: From one look at a clock, or at a condition, to the next [s, wall clock].
LOOK_PERIOD = 0.05


def steady_time():
    """Seconds on a clock that never stands still and never goes back, whatever ROS time does.

    It also goes on while the computer is suspended, unlike time.monotonic(): after that a
    permission is old.
    """
    return time.clock_gettime(time.CLOCK_BOOTTIME)


def wait_until(condition, seconds, period=LOOK_PERIOD):
    """Wait until `condition()` holds, which is asked every `period` [s]; False if it still does not
    after `seconds` of wall time."""
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(period)
    return True


def say_if_no_clock_comes():
    """Start to wait for /clock, in a thread of its own; every node does."""
    if not is_wall_time():
        threading.Thread(target=_wait_for_clock, name='clock', daemon=True).start()


def _wait_for_clock():
    due = time.monotonic() + FIRST_WARNING
    while rospy.get_time() == 0.0 and not rospy.is_shutdown():
        if time.monotonic() >= due:
            due += NEXT_WARNING
            rospy.logerr('/use_sim_time is true, but nobody publishes /clock: start a simulation, '
                         'or: rosparam set /use_sim_time false, and start the nodes again')
        time.sleep(LOOK_PERIOD)


class ClockWatch:
    """Knows whether ROS time runs; `on_standstill()` is called when it stops.

    With wall time there is nothing to watch, and no thread.
    """

    def __init__(self, on_standstill):
        self._on_standstill = on_standstill
        #: False while there is no time to drive by.
        self.runs = is_wall_time()
        if not self.runs:
            threading.Thread(target=self._watch, name='clock_watch', daemon=True).start()

    def _watch(self):
        last, changed_at = 0.0, -STANDSTILL
        while not rospy.is_shutdown():
            now = rospy.get_time()
            if now != last:
                last, changed_at = now, time.monotonic()
            runs = time.monotonic() - changed_at < STANDSTILL
            # `runs` first: a command that is sent now comes before the zero, none after it
            stopped, self.runs = self.runs and not runs, runs
            if stopped:
                self._on_standstill()
                rospy.logwarn('/clock stands still: nothing is driven until it goes on')
            time.sleep(LOOK_PERIOD)
