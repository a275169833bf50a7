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
from collections import defaultdict, deque

import rospy
from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_updater import Updater
from geometry_msgs.msg import Twist

from tb3_labs.ros.clocks import ClockWatch, steady_time
from tb3_labs.ros.conversions import to_twist
from tb3_labs.ros.node import guarded, when_stopped
from tb3_labs.ros.rospy_internals import connection_of
from tb3_labs.ros.topics import subscribe

#: A smaller speed turns no motor [m/s], [rad/s]: their steps are eight times as large. The firmware
#: takes a number such as 1e-40 for full speed.
LEAST_SPEED = 1e-4
#: Wait until the last zero has left the process [s]: rospy that ends drops what its queues hold.
DELIVERY_TIME = 0.15
#: The watchdog begins to check a node when no message came for this long [s, wall clock], half the
#: shortest timeout.
QUIET_TIME = 0.1
#: Period of the checks after QUIET_TIME, until the next message [s].
CHECK_PERIOD = 0.02
#: A node that does not drive looks at the clock with this period, so that it notices a sleep [s].
IDLE_PERIOD = 0.1
#: Another node is a rival if it sends this many commands in FIGHT_TIME while this one drives.
FIGHT = 3
#: Time in which these commands are counted [s].
FIGHT_TIME = 1.0
#: Commands in the first moment of driving [s] do not count: another node may just have stopped.
FIRST_MOMENT = 0.3
#: Time between two warnings of the same rival [s].
WARNING_PERIOD = 10.0
#: A node hears its own commands, too. It reads them once in this time [s].
OWN_PERIOD = 0.3
#: Time between two reports [s, wall clock].
REPORT_PERIOD = 1.0


class CmdVel:
    """Publishes `cmd_vel` (geometry_msgs/Twist)."""

    def __init__(self):
        self._lock = threading.Lock()  # guards the next two, and the order of publications
        self._driving_since = None     # [s, monotonic]; None while this node does not drive
        self._closed = False           # True at the end, and while Ctrl+Z has stopped the process
        self._publisher = rospy.Publisher('cmd_vel', Twist, queue_size=1, tcp_nodelay=True)
        self._clock = ClockWatch(self.stop)
        rospy.on_shutdown(self._close)
        when_stopped(self._close, self._open)

    @property
    def is_heard(self):
        """Does a robot (or any node) listen?"""
        return self._publisher.get_num_connections() > 0

    @property
    def driving_for(self):
        """Time for which this node has been driving without a stop [s]; 0 while it is not."""
        since = self._driving_since
        return time.monotonic() - since if since is not None else 0.0

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
                self._driving_since = self._driving_since or time.monotonic()
                self._publisher.publish(to_twist(linear, angular))

    def stop(self):
        """Send one zero if this node was driving, otherwise nothing."""
        with self._lock:
            self._stop()

    def _stop(self):
        """As :meth:`stop`; the caller holds the lock. Returns True if a zero was sent."""
        was_driving = self._driving_since is not None
        if was_driving:
            self._driving_since = None
            self._publisher.publish(to_twist(0.0, 0.0))
        return was_driving

    def _close(self):
        with self._lock:
            self._closed = True
            if self._stop():
                time.sleep(DELIVERY_TIME)

    def _open(self):
        with self._lock:
            self._closed = rospy.is_shutdown()


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


class Rivals:
    """Finds other nodes that publish on `cmd_vel`. This node drives by its own CmdVel."""

    def __init__(self, cmd_vel, heard=lambda command: None):
        """`heard(Twist)` is called with each command of another node."""
        self._cmd_vel = cmd_vel
        self._heard = heard
        self._lock = threading.Lock()    # guards the next two; each rival has a thread of its own
        self._seen = defaultdict(lambda: deque(maxlen=FIGHT))   # times of each node's commands
        self._warned = {}
        subscribe('cmd_vel', Twist, self._on_command)

    @property
    def complaint(self):
        """'also driven by' and the names of the rivals; '' if there are none."""
        with self._lock:
            rivals = [name for name, times in self._seen.items() if self._is_rival(times)]
        return 'also driven by ' + ', '.join(sorted(rivals)) if rivals else ''

    def _on_command(self, message):
        sender = connection_of(message)['callerid']
        if sender == rospy.get_name():
            time.sleep(OWN_PERIOD)    # in the thread of that connection, which drops the others
            return
        self._heard(message)
        if self._cmd_vel.driving_for >= FIRST_MOMENT and self._is_to_be_named(sender):
            rospy.logwarn('%s sends commands while %s drives: stop one of them', sender,
                          rospy.get_name())

    def _is_to_be_named(self, sender):
        now = time.monotonic()
        with self._lock:
            self._seen[sender].append(now)
            if not self._is_rival(self._seen[sender]) or (
                    now - self._warned.get(sender, -WARNING_PERIOD) < WARNING_PERIOD):
                return False
            self._warned[sender] = now
            return True

    @staticmethod
    def _is_rival(times):
        return len(times) == FIGHT and time.monotonic() - times[0] <= 2.0 * FIGHT_TIME and (
            times[-1] - times[0] <= FIGHT_TIME)


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
