"""The four clocks, and the purpose of each clock.

    ros_time()         the age of sensors, all steps of a drive; ROS time may be simulated
    steady_time()      input of people (a pad, a mouse, a renewed permission), the watchdog
    time.monotonic()   deadlines of waits, pauses between warnings
    time.time()        the wall clock, which is ROS time if there is no simulated clock

Periodic work has a thread that sleeps by the wall clock, because ``rospy.sleep`` and
``rospy.Timer`` stop with a simulated clock.
"""
import time

import rospy

from tb3_labs.ros.rospy_internals import is_wall_time

#: Time [s, wall clock] between two checks of a condition.
POLL_PERIOD = 0.05


def ros_time():
    """Returns the same time as rospy.get_time(), in a tenth of its computing time."""
    return time.time() if is_wall_time() else rospy.get_time()


def steady_time():
    """Returns the time [s] of a clock that never goes back. This clock also runs while the computer
    is suspended, so that a permission expires. time.monotonic() would stand still."""
    return time.clock_gettime(time.CLOCK_BOOTTIME)


def wait_until(condition, seconds, period=POLL_PERIOD):
    """Wait at most `seconds` of wall time for `condition()`. Returns whether it became true."""
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(period)
    return True
