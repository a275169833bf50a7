"""Waiting while a node is tried out. Times are wall time: a node cannot stop them."""
import time

import rospy

#: How often a condition is looked at [s].
PERIOD = 0.02


def wait(seconds):
    """Let this time go by [s]."""
    rospy.rostime.wallsleep(seconds)


def wait_until(condition, seconds, period=PERIOD):
    """True as soon as `condition()` holds, False after this time [s]; `period`: between two looks
    [s]."""
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() >= deadline:
            return False
        wait(period)
    return True
