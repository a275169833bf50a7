"""The four clocks, and the purpose of each clock.

    ros_time()         the age of sensors, all steps of a drive; ROS time may be simulated
    steady_time()      input of people (a pad, a mouse, a renewed permission), the watchdog
    time.monotonic()   deadlines of waits, pauses between warnings
    time.time()        the wall clock, which is ROS time if there is no simulated clock

Threads sleep by the wall clock, since ``rospy.sleep`` and ``rospy.Timer`` stop with simulated time.
"""
import time

import rospy

from tb3_labs.ros.rospy_internals import is_wall_time


def ros_time():
    """Returns the same time as rospy.get_time(), in a tenth of the computing time."""
    return time.time() if is_wall_time() else rospy.get_time()


def steady_time():
    """Returns the time [s] of a clock that never goes back. Unlike time.monotonic(), this clock
    also runs while the computer is suspended, so that permissions expire."""
    return time.clock_gettime(time.CLOCK_BOOTTIME)


def wait_until(condition, seconds, period=0.05):
    """Wait at most `seconds` of wall time. Returns True as soon as ``condition()`` is true. The
    condition is checked every `period` [s]."""
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(period)
    return True
