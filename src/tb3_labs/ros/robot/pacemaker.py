"""The time of embedded robots: real time, or their own on /clock."""
import itertools
import threading
import time

import rospy
from rosgraph_msgs.msg import Clock

from tb3_labs.ros.node import guarded
from tb3_labs.ros.robot.fake_robot import STEP
from tb3_labs.ros.robot.sensor_topics import publisher
from tb3_labs.ros.rospy_internals import publish_now

#: A longer pause of the computer is not made up for [s].
CATCH_UP = 0.5
#: The same with a /clock of its own [s, wall clock]. What is made up for comes at once. `speed` times
#: as long, on that /clock: a node that hears of it too late finds its sensors silent.
CATCH_UP_CLOCK = 0.02


class Pacemaker:
    """Steps robots: in real time, or `speed` times as fast with a /clock that it publishes.

    That /clock runs in real time until a node listens to it, so that no node waits for a clock or
    misses the start.
    """

    def __init__(self, robots, speed):
        self._robots = robots
        self._epoch = time.time()  # the robots' time 0, also with their own /clock
        if rospy.get_param('/use_sim_time', False):
            self._take(publisher('/clock', Clock), speed)
        else:
            self._take(None, 1.0)
        self._thread = threading.Thread(target=guarded(self._run), name='robot', daemon=True)
        self._ending = threading.Event()  # rospy.is_shutdown() is true only after its hooks
        rospy.on_shutdown(self._end)
        self._thread.start()

    def _take(self, clock, speed):
        """Run by real time, or by a /clock of its own; `clock` publishes it."""
        self._clock, self._speed = clock, speed
        self._catch_up = CATCH_UP if clock is None else CATCH_UP_CLOCK

    def _end(self):
        self._ending.set()
        if threading.current_thread() is not self._thread:
            self._thread.join()

    def _run(self):
        due = time.monotonic()
        speed = 1.0
        for step in itertools.count():
            if self._ending.is_set():
                return
            if self._clock:
                publish_now(self._clock, Clock(rospy.Time.from_sec(self._epoch + (step + 1) * STEP)))
            for robot in self._robots:
                robot.tick(step, self._epoch)
            if speed != self._speed and any(robot.is_heard for robot in self._robots):
                speed = self._speed
            due += STEP / speed
            late = time.monotonic() - due
            if late < 0.0:
                time.sleep(-late)
            elif late > self._catch_up:
                due += late
                self._epoch += 0.0 if self._clock else late
