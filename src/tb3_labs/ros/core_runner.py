"""Gives messages to the core of a node and carries out the Outputs of the core in order.

A thread that holds one of these locks may take only the locks below it in the list:

    1  the locks of shutdown hooks, dynamic settings, diagnostics and actionlib. These parts call
       the node while they hold their lock. So a node holds no lock when it calls one of them.
    2  the CoreRunner's lock, which guards the core and the commands
    3  the locks of rospy's topics and of rospy's log

A thread that holds the lock of a CoreRunner does not wait for a service, a message or a subscriber.
"""
import queue
import threading
import time

import rospy
from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_updater import Updater

from tb3_labs.ros.clocks import steady_time
from tb3_labs.ros.cmd_vel import CmdVel
from tb3_labs.ros.node import guarded
from tb3_labs.ros.rospy_internals import is_wall_time
from tb3_labs.ros.topics import INVALID_COUNTS
from tb3_labs.supervision.timeouts import (
    CHECK_PERIOD, IDLE_PERIOD, QUIET_TIME, STANDSTILL_TIME, Freshness)

DIAGNOSTICS_PERIOD = 1.0    # [s, wall clock]


class CoreRunner:
    """Guards a core (:mod:`tb3_labs.nodes`) by one lock. The CoreRunner also holds the lock while
    it sends a command. So no thread can send an older command after a stop. A blocked terminal or
    actionlib must not delay a stop. So a separate thread carries out the rest of an Output."""

    def __init__(self, tick, publish=lambda output: None, carry_out=lambda output: None):
        """``tick()`` returns the core's next Output. ``publish(output)`` is called under the lock
        and must not wait. ``carry_out(output)`` is called later without the lock and may wait."""
        self._tick, self._publish, self._carry_out = tick, publish, carry_out
        self._lock = threading.Lock()
        self._waiting_outputs = queue.SimpleQueue()    # for carry_out
        threading.Thread(target=guarded(self._log_and_carry_out), name='core runner',
                         daemon=True).start()
        self._cmd_vel = CmdVel()
        rospy.on_shutdown(self._close)
        self._watchdog = Watchdog(self.decide, self._on_clock)

    def call_and_decide(self, method, *arguments):
        """Give a message to the core by ``method(*arguments)``, let the core decide, and return its
        Output. `method` itself must read the clock. A time that was read before the lock was taken
        could be older than the core's last decision."""
        with self._lock:
            method(*arguments)
            output = self._tick_and_send()
        self._watchdog.on_message_handled()
        return output

    def decide(self):
        """Let the core decide now, without a message."""
        with self._lock:
            self._tick_and_send()

    def call_core(self, method, *arguments):
        """Returns the result of the core's ``method(*arguments)``. The core does not decide."""
        with self._lock:
            return method(*arguments)

    def _tick_and_send(self):
        """Let the core decide, and send the core's command. The caller holds the lock."""
        output = self._tick()
        if output.must_stop_first:
            self._cmd_vel.stop()
        if output.command is not None:
            self._cmd_vel.send(output.command)
        self._publish(output)
        self._watchdog.set_awake(output.needs_fast_ticks)
        if output.has_other_work:
            self._waiting_outputs.put(output)
        return output

    def _on_clock(self, clock_runs):
        with self._lock:
            has_stopped = self._cmd_vel.set_clock_runs(clock_runs)
        if has_stopped:
            rospy.logwarn('/clock stands still: nothing is driven until it goes on')

    def _close(self):
        with self._lock:
            self._cmd_vel.close()

    def _log_and_carry_out(self):
        while True:
            output = self._waiting_outputs.get()
            for line in output.log_lines:
                log = rospy.logwarn if line.is_warning else rospy.loginfo
                log('%s', line.text)
            self._carry_out(output)


class Watchdog:
    """Calls `on_quiet()` in a separate thread while no message arrives. A rospy.Timer would not do
    this while a simulated clock stands still. If time is simulated, the thread also calls
    `on_clock(clock_runs)`. The first call of :meth:`set_awake` starts the thread."""

    def __init__(self, on_quiet, on_clock):
        self._on_quiet, self._on_clock = on_quiet, on_clock
        self._awake = threading.Event()
        self._messages = Freshness('message', QUIET_TIME)
        self._clock = Freshness('/clock', STANDSTILL_TIME)
        self._last_time = 0.0
        self._thread = threading.Thread(target=guarded(self._watch), name='watchdog', daemon=True)

    def set_awake(self, is_awake):
        """Call `on_quiet()` often if `is_awake`, else seldom. The caller holds the lock."""
        if not self._thread.ident:
            self._thread.start()
        if is_awake:
            self._awake.set()
        else:
            self._awake.clear()

    def on_message_handled(self):
        self._messages.on_message(steady_time())

    def _watch(self):
        while not rospy.is_shutdown():
            is_awake = self._awake.wait(IDLE_PERIOD)
            self._check_clock()
            quiet_time = self._messages.timeout if is_awake else IDLE_PERIOD
            remaining_quiet_time = quiet_time - self._messages.age(steady_time())
            if remaining_quiet_time <= 0.0:
                self._on_quiet()
            if is_awake:
                time.sleep(max(CHECK_PERIOD, remaining_quiet_time))

    def _check_clock(self):
        if is_wall_time():
            return
        now = rospy.get_time()
        if now != self._last_time:
            self._last_time = now
            self._clock.on_message(steady_time())
        self._on_clock(self._clock.is_fresh(steady_time()))


def publish_diagnostics(hardware, report):
    """From now on, publish ``report()`` on `/diagnostics` every second. ``report()`` returns
    ``(problem, {name: value})`` and is called without a lock."""
    def fill(status):
        problem, values = report()
        level = DiagnosticStatus.WARN if problem else DiagnosticStatus.OK
        status.summary(level, problem or 'OK')
        for name, value in values.items():
            status.add(name, str(value))
        return status

    def repeat():
        while True:
            time.sleep(DIAGNOSTICS_PERIOD)
            updater.force_update()

    updater = Updater()
    updater.setHardwareID(hardware)
    updater.add('state', fill)    # the Updater puts the node's name before 'state'
    threading.Thread(target=guarded(repeat), name='diagnostics', daemon=True).start()


def values_of(freshness, now):
    """Returns the values of a Freshness, such as {'imu age [s]': '0.004', 'imu dropped': 0}."""
    return {freshness.name + ' age [s]': f'{freshness.age(now):.3f}',
            freshness.name + ' dropped': INVALID_COUNTS[freshness.name]}
