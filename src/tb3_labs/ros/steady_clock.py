"""Time for what is in people's hands: a pad, a mouse, a permission that is renewed."""
import time


def steady_time():
    """Seconds on a clock that never stands still and never goes back, whatever ROS time does.

    It also goes on while the computer is suspended, unlike time.monotonic(): after that a
    permission is old.
    """
    return time.clock_gettime(time.CLOCK_BOOTTIME)
