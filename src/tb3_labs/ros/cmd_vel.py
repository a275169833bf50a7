"""The one way in which this package drives and stops a robot, and what a driving node reports.

When a node that drives stops, for any reason, it publishes exactly one zero and is then silent, so
that another node may drive. The zero is also sent when the node shuts down (Ctrl+C, SIGTERM, a
closed terminal, an exception that ended it), when the process is stopped by Ctrl+Z, and when the
node's clock stands still. A process that ends, or is stopped, first gives rospy the time to write
the zero to each subscriber. Once a second a driving node publishes `/diagnostics`, for
rqt_robot_monitor and rostopic.
"""
import math
import threading
import time

import rospy
from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_updater import Updater
from geometry_msgs.msg import Twist

from tb3_labs.ros.clocks import LOOK_PERIOD, steady_time
from tb3_labs.ros.conversions import to_twist
from tb3_labs.ros.node import guarded, when_stopped
from tb3_labs.ros.rospy_internals import (
    connection_of, hear_others_alone, is_wall_time, sender_of)
from tb3_labs.ros.topics import subscribe

#: A smaller speed turns no motor [m/s], [rad/s]: their steps are eight times as large. The firmware
#: takes a number such as 1e-40 for full speed.
LEAST_SPEED = 1e-4
#: Wait until the last zero has left the process [s]: rospy that ends drops what its queues hold.
DELIVERY_TIME = 0.15
#: A clock that does not change for this long stands still [s, wall clock].
STANDSTILL = 0.3
#: The watchdog begins to check a node when no message came for this long [s, wall clock], half the
#: shortest timeout.
QUIET_TIME = 0.1
#: Period of the checks after QUIET_TIME, until the next message [s].
CHECK_PERIOD = 0.02
#: A node that does not drive looks at the clock with this period, so that it notices a sleep [s].
IDLE_PERIOD = 0.1
#: Time between two reports [s, wall clock].
REPORT_PERIOD = 1.0


class CmdVel:
    """Publishes `cmd_vel` (geometry_msgs/Twist)."""

    def __init__(self):
        self._lock = threading.Lock()  # guards the next two, and the order of publications
        self._drives = False
        self._closed = False           # True at the end, and while Ctrl+Z has stopped the process
        self._publisher = rospy.Publisher('cmd_vel', Twist, queue_size=1, tcp_nodelay=True)
        self._clock = ClockWatch(self.stop)
        rospy.on_shutdown(self._close)
        when_stopped(self._close, self._open)

    @property
    def is_heard(self):
        """Does a robot (or any node) listen?"""
        return self._publisher.get_num_connections() > 0

    def send(self, command):
        """Send `command`, a Twist2; speeds below LEAST_SPEED are zero. None, zero, and every
        command while the clock stands still are a :meth:`stop`. Raises ``ValueError`` if a number
        is not finite."""
        linear, angular = (command.linear, command.angular) if command is not None else (0.0, 0.0)
        if not (math.isfinite(linear) and math.isfinite(angular)):
            raise ValueError('command ({}, {}) is not finite'.format(linear, angular))
        linear, angular = (speed if abs(speed) >= LEAST_SPEED else 0.0
                           for speed in (linear, angular))
        with self._lock:
            if linear == angular == 0.0 or not self._clock.runs:
                self._stop()
            elif not self._closed:
                self._drives = True
                self._publisher.publish(to_twist(linear, angular))

    def stop(self):
        """Send one zero if this node was driving, otherwise nothing."""
        with self._lock:
            self._stop()

    def _stop(self):
        """As :meth:`stop`; the caller holds the lock. Returns True if a zero was sent."""
        drove, self._drives = self._drives, False
        if drove:
            self._publisher.publish(to_twist(0.0, 0.0))
        return drove

    def _close(self):
        with self._lock:
            self._closed = True
            if self._stop():
                time.sleep(DELIVERY_TIME)

    def _open(self):
        with self._lock:
            self._closed = rospy.is_shutdown()


class ClockWatch:
    """Knows whether ROS time runs; `on_standstill()` is called when it stops.

    With wall time there is nothing to watch, and no thread.
    """

    def __init__(self, on_standstill):
        self._on_standstill = on_standstill
        #: False while the clock stands still: nothing may be driven then.
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
            # `runs` changes before the zero is sent, so that no command can follow the zero
            stopped, self.runs = self.runs and not runs, runs
            if stopped:
                self._on_standstill()
                rospy.logwarn('/clock stands still: nothing is driven until it goes on')
            time.sleep(LOOK_PERIOD)


class Watchdog:
    """Calls `check()`, guarded, in a thread of its own: every CHECK_PERIOD while the watchdog is
    awake and not fed, every IDLE_PERIOD while it is not awake.

    The thread begins with the first call of :meth:`keep`. A rospy.Timer would stop with the
    simulated clock, just when the check is needed.
    """

    def __init__(self, check, quiet_time=QUIET_TIME):
        self._check = guarded(check)
        self._quiet_time = quiet_time
        self._awake = threading.Event()
        self._fed_at = -math.inf
        self._thread = threading.Thread(target=self._run, name='watchdog', daemon=True)

    def keep(self, awake):
        """`awake`: does the node drive, so that it must be checked often? The caller holds the
        node's lock."""
        if not self._thread.ident:
            self._thread.start()
        if awake is not self._awake.is_set():    # a look costs less than setting it again
            (self._awake.set if awake else self._awake.clear)()

    def feed(self):
        """Tell the watchdog that a message has arrived and was processed."""
        self._fed_at = steady_time()

    def _run(self):
        while not rospy.is_shutdown():
            is_awake = self._awake.wait(IDLE_PERIOD)
            patient_for = self._fed_at + self._quiet_time - steady_time()
            if is_awake and patient_for > 0.0:
                time.sleep(patient_for)
            else:
                self._check()
                if is_awake:
                    time.sleep(CHECK_PERIOD)


def hear_other_drivers(heard):
    """Call ``heard(sender, Twist)`` with each command that another node gives the robot."""
    subscribe(hear_others_alone('cmd_vel'), Twist,
              lambda message: heard(sender_of(connection_of(message)), message))


class Diagnostics:
    """Publishes the answer of `report()`: ``(problem or '', {name: value})``.

    `report` is called without a lock once a second, also without a subscriber.
    """

    def __init__(self, hardware, report):
        self._report = report
        self._updater = Updater()
        self._updater.setHardwareID(hardware)
        self._updater.add('state', self._fill)    # the Updater puts the node's name before it
        self._ending = threading.Event()
        rospy.on_shutdown(self._ending.set)
        threading.Thread(target=guarded(self._run), name='diagnostics', daemon=True).start()

    def _run(self):
        while not self._ending.wait(REPORT_PERIOD):
            self._updater.force_update()

    def _fill(self, status):
        problem, values = self._report()
        status.summary(DiagnosticStatus.WARN if problem else DiagnosticStatus.OK, problem or 'OK')
        for name, value in values.items():
            status.add(name, str(value))
        return status


def values_of(source, now):
    """Returns {'imu age [s]': '0.004', 'imu dropped': 0} of a freshness.Freshness: its age, and the
    number of its invalid messages."""
    return {source.name + ' age [s]': '{:.3f}'.format(source.age(now)),
            source.name + ' dropped': source.dropped}
