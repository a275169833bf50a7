"""The runner of a core: messages go in, and what the core decides leaves in order.

When a node that drives stops, for any reason, it publishes exactly one zero and is then silent, so
that another node may drive. The zero is also sent when the node shuts down (a signal, an exception
that ended it), and when its clock stands still.

A thread that holds a lock takes only locks further down in this list:
    1  locks of the parts that call a node back: the hooks of its end, dynamic settings,
       diagnostics, actionlib. A node that calls these parts holds no lock.
    2  the lock of the node, its CoreRunner's, which guards its core and its commands
    3  locks of rospy's topics, and of its log
A thread that holds a node's lock does not wait for a service, a message or a subscriber.
"""
import math
import queue
import threading
import time

import rospy
from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_updater import Updater
from geometry_msgs.msg import Twist

from tb3_labs.ros.clocks import steady_time
from tb3_labs.ros.node import guarded
from tb3_labs.ros.rospy_internals import is_wall_time, write_at_once
from tb3_labs.ros.topics import DROPPED
from tb3_labs.supervision.timeouts import (
    CHECK_PERIOD, IDLE_PERIOD, QUIET_TIME, STANDSTILL_TIME, Freshness)

#: A smaller speed turns no motor [m/s], [rad/s]; the firmware reads 1e-40 as full speed.
LEAST_SPEED = 1e-4
#: Time between two reports [s, wall clock].
REPORT_PERIOD = 1.0


class CoreRunner:
    """Guards a core (:mod:`tb3_labs.nodes`) by one lock, which is taken once for each message.

    The command is sent while the lock is held: no drive that was decided before a stop follows it.
    The rest of an Output is carried out without the lock, in the same order, by a thread of its
    own. So a terminal that takes no text, or actionlib, holds up no message and no stop.
    """

    def __init__(self, tick, publish=None, carry_out=None):
        """``tick()`` returns the Output of now. ``publish(output)`` is called with the lock held,
        after the command was sent, and must not wait. ``carry_out(output)`` is called without it.
        """
        self._tick, self._publish, self._carry_out = tick, publish, carry_out
        self._lock = threading.Lock()
        self._waiting = queue.SimpleQueue()    # Outputs that are not carried out yet
        threading.Thread(target=guarded(self._run), name='core runner', daemon=True).start()
        self.cmd_vel = CmdVel()
        rospy.on_shutdown(self._close)
        self._watchdog = Watchdog(self.check, self._note_clock)

    def handle(self, method, *arguments):
        """Call ``method(*arguments)`` of the core, which takes in a message, and let the core
        decide. Returns the Output. `method` itself reads the clock: a time from before the lock may
        be older than the core's last time."""
        with self._lock:
            method(*arguments)
            output = self._decide()
        self._watchdog.feed()
        return output

    def check(self):
        """Let the core look at the clock."""
        with self._lock:
            self._decide()

    def query(self, method, *arguments):
        """Returns ``method(*arguments)`` of the core, without a decision: for a question, or for a
        sample that only checks other samples."""
        with self._lock:
            return method(*arguments)

    def _decide(self):
        """Let the core decide, and send its command. The caller holds the lock."""
        output = self._tick()
        if output.stops_first:
            self.cmd_vel.stop()
        if output.command is not None:
            self.cmd_vel.send(output.command)
        if self._publish is not None:
            self._publish(output)
        self._watchdog.set_awake(output.watched)
        if output.has_more:
            self._waiting.put(output)
        return output

    def _note_clock(self, runs):
        with self._lock:
            stands = self.cmd_vel.note_clock(runs)
        if stands:
            rospy.logwarn('/clock stands still: nothing is driven until it goes on')

    def _close(self):
        with self._lock:
            self.cmd_vel.close()

    def _run(self):
        while True:
            output = self._waiting.get()
            for line in output.log_lines:
                (rospy.logwarn if line.warning else rospy.loginfo)('%s', line.text)
            if self._carry_out is not None:
                self._carry_out(output)


class CmdVel:
    """Publishes `cmd_vel` (geometry_msgs/Twist). Its caller holds the lock of the CoreRunner."""

    def __init__(self):
        self._clock_runs = is_wall_time()
        self._drives = False
        self._closed = False           # the node ends
        self._message = Twist()        # publish() has read it when it returns
        self._publisher = rospy.Publisher('cmd_vel', Twist, queue_size=1, tcp_nodelay=True)
        write_at_once(self._publisher)

    @property
    def has_subscribers(self):
        """Does a robot (or any node) listen?"""
        return self._publisher.get_num_connections() > 0

    def send(self, command):
        """Send `command`, a Twist2; speeds below LEAST_SPEED are zero. Zero, and every command
        while the clock stands still, are a :meth:`stop`. ``ValueError`` if one is not finite."""
        linear, angular = command
        if not math.isfinite(linear + angular):
            raise ValueError(f'command ({linear}, {angular}) is not finite')
        linear = linear if abs(linear) >= LEAST_SPEED else 0.0
        angular = angular if abs(angular) >= LEAST_SPEED else 0.0
        if linear == angular == 0.0 or not self._clock_runs:
            self.stop()
        elif not self._closed:
            self._drives = True
            self._publish(linear, angular)

    def stop(self):
        """Send one zero if this node was driving, otherwise nothing."""
        if self._drives:
            self._drives = False
            self._publish(0.0, 0.0)

    def close(self):
        """Stop for good."""
        self._closed = True
        self.stop()

    def note_clock(self, runs):
        """Take in whether ROS time runs: while it stands still, nothing may be driven. Returns True
        if it has just stopped."""
        stands, self._clock_runs = self._clock_runs and not runs, runs
        if stands:
            self.stop()
        return stands

    def _publish(self, linear, angular):
        self._message.linear.x, self._message.angular.z = linear, angular
        self._publisher.publish(self._message)


class Watchdog:
    """Calls `check()` in a separate thread while no message arrives. Also calls `note_clock(runs)`
    if the clock is simulated.

    The thread begins with the first call of :meth:`set_awake`. A rospy.Timer would stop with the
    simulated clock, just when the check is needed.
    """

    def __init__(self, check, note_clock):
        self._check, self._note_clock = check, note_clock
        self._awake = threading.Event()
        self._messages = Freshness('message', QUIET_TIME)
        self._clock, self._last = Freshness('/clock', STANDSTILL_TIME), 0.0
        self._thread = threading.Thread(target=guarded(self._run), name='watchdog', daemon=True)

    def set_awake(self, awake):
        """Check the node often if it is `awake`. The caller holds the node's lock."""
        if not self._thread.ident:
            self._thread.start()
        if awake is self._awake.is_set():    # reading it costs less than setting it again
            return
        if awake:
            self._awake.set()
        else:
            self._awake.clear()

    def feed(self):
        """Tell the watchdog that a message has arrived and was processed."""
        self._messages.received(steady_time())

    def _run(self):
        while not rospy.is_shutdown():
            is_awake = self._awake.wait(IDLE_PERIOD)
            self._check_clock()
            quiet_time = self._messages.timeout if is_awake else IDLE_PERIOD
            quiet_left = quiet_time - self._messages.age(steady_time())
            if quiet_left <= 0.0:
                self._check()
            if is_awake:
                time.sleep(max(CHECK_PERIOD, quiet_left))

    def _check_clock(self):
        if not is_wall_time():
            now = rospy.get_time()
            if now != self._last:
                self._last = now
                self._clock.received(steady_time())
            self._note_clock(self._clock.is_fresh(steady_time()))


class Diagnostics:
    """Publishes the answer of `report()`, ``(problem, {name: value})``, to `/diagnostics`, once a
    second. `report` is called without a lock."""

    def __init__(self, hardware, report):
        self._report = report
        self._updater = Updater()
        self._updater.setHardwareID(hardware)
        self._updater.add('state', self._fill)    # the Updater puts the node's name before it
        threading.Thread(target=guarded(self._run), name='diagnostics', daemon=True).start()

    def _run(self):
        while True:
            time.sleep(REPORT_PERIOD)
            self._updater.force_update()

    def _fill(self, status):
        problem, values = self._report()
        status.summary(DiagnosticStatus.WARN if problem else DiagnosticStatus.OK, problem or 'OK')
        for name, value in values.items():
            status.add(name, str(value))
        return status


def values_of(topic, source, now):
    """Returns {'imu age [s]': '0.004', 'imu dropped': 0} of a topic: the age of its Freshness, and
    the number of its invalid messages."""
    return {source.name + ' age [s]': f'{source.age(now):.3f}',
            source.name + ' dropped': DROPPED[topic]}
