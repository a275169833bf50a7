"""The clocks, the use of each, and reports of a /clock that is missing.

    ros_time()         ROS time, simulated or not: the age of sensors, all steps of a drive
    steady_time()      input of people: a pad, a mouse, a permission that is renewed
    time.monotonic()   deadlines of waits, pauses between warnings, the watchdog
    time.time()        only the moment at which the simulated robot's own time begins

Periodic work has a thread that sleeps by the wall clock, since ``rospy.sleep`` and ``rospy.Timer``
stop with a simulated clock.
"""
import threading
import time

import rospy

from tb3_labs.ros.rospy_internals import is_wall_time

#: Time before the first reminder of something that is missing [s, wall clock].
FIRST_REMINDER = 2.0
#: Time between later reminders [s, wall clock].
NEXT_REMINDER = 10.0
#: Time between two looks at a condition [s, wall clock].
LOOK_PERIOD = 0.05


def ros_time():
    """rospy.get_time(), which takes ten times as long."""
    return time.time() if is_wall_time() else rospy.get_time()


def steady_time():
    """Seconds on a clock that never stands still and never goes back, independent of ROS time.

    Unlike time.monotonic(), this clock goes on while the computer is suspended. So a permission is
    old afterwards.
    """
    return time.clock_gettime(time.CLOCK_BOOTTIME)


def wait_until(condition, seconds, period=LOOK_PERIOD):
    """Check `condition()` every `period` [s] until it is true. Returns False if it is not true
    after `seconds` of wall time."""
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(period)
    return True


def remind(tell, first=FIRST_REMINDER):
    """Start a thread that calls `tell()` after `first` [s, wall clock], and again every
    NEXT_REMINDER as long as it returns a true value: something is still missing."""
    def run():
        time.sleep(first)
        while not rospy.is_shutdown() and tell():
            time.sleep(NEXT_REMINDER)

    threading.Thread(target=run, name='reminder', daemon=True).start()


def say_if_no_clock_comes():
    """Report a missing /clock."""
    def tell():
        is_missing = rospy.get_time() == 0.0
        if is_missing:
            rospy.logerr('/use_sim_time is true, but nobody publishes /clock: start a simulation, '
                         'or: rosparam set /use_sim_time false, and start the nodes again')
        return is_missing

    if not is_wall_time():
        remind(tell)
