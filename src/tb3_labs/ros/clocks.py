"""The four clocks, and the purpose of each clock.

    ros_time()         times samples of sensors and steps of drives, and may be simulated time
    steady_time()      times the watchdog, and what people do (a pad, a mouse, a permission)
    time.monotonic()   times the deadlines of waits, and the pauses between warnings
    time.time()        is the wall clock, and without a simulated clock the ROS time

Threads sleep by the wall clock, since ``rospy.sleep`` waits without end if simulated time stops.
"""
import time

import rospy

from tb3_labs.ros.rospy_internals import is_wall_time


def ros_time():
    """Returns the same time as rospy.get_time(), but needs only a tenth of its computing time."""
    return time.time() if is_wall_time() else rospy.get_time()


def steady_time():
    """Returns the time [s] of a clock that never goes back. Unlike time.monotonic(), this clock
    also runs while the computer is suspended, so that permissions expire."""
    return time.clock_gettime(time.CLOCK_BOOTTIME)


def wait_until(condition, seconds, period=0.05):
    """Wait until ``condition()`` is true, at most for `seconds` of wall time. Returns False if the
    time is over before. The condition is checked every `period` [s]."""
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(period)
    return True
