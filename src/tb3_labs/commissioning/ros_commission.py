"""The test drive of a robot of ROS: its topics, the person at the terminal, and the files.

Threads: `drive` alone sends commands, every 4 ms at most; `keyboard` reads the terminal, and writes
the files at the end. Both hold the lock while they use the ride, and never while they wait.
"""
import os
import select
import socket
import sys
import termios
import threading
import time
import tty
from urllib.parse import urlparse

import rosgraph
import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import BatteryState, Imu
from std_msgs.msg import Empty

from tb3_labs.commissioning.estimates import estimates
from tb3_labs.commissioning.findings import FAULT, findings, printed, summary
from tb3_labs.commissioning.page import html, settings, yaml_text
from tb3_labs.commissioning.recording import Recording
from tb3_labs.commissioning.ride import KEY, Phase, Ride
from tb3_labs.control.speed_laws import Twist2
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.cmd_vel import CmdVel, Rivals
from tb3_labs.ros.conversions import to_imu_sample, to_odometry_sample
from tb3_labs.ros.node import end, guarded, read_model
from tb3_labs.ros.rospy_internals import is_wall_time
from tb3_labs.ros.topics import subscribe, subscribe_wheels

#: Time between two looks at the ride [s, wall clock].
LOOK = 0.004
#: The robot sends, and is connected to this node, within this time [s].
CONNECTING = 10.0
#: Number of questions that measure the delay to the robot, and longest wait for an answer [s].
QUESTIONS, PATIENCE = 5, 1.0


class Commission:
    """One test drive of the robot in this node's namespace. Ends the node when it is over."""

    def __init__(self, name, steps, folder):
        """`name`: that of the files, which are written to the Path `folder`."""
        self._name, self._folder, self._count = name, folder, len(steps)
        self._model = read_model()
        self._lock = threading.Lock()       # guards the recording and the ride
        self._recording = Recording()
        self._ride = Ride(self._recording, steps)
        self._terminal = Terminal()
        rospy.on_shutdown(self._terminal.restore)
        self._cmd_vel = CmdVel()
        Rivals(self._cmd_vel)
        self._reset = rospy.Publisher('reset', Empty, queue_size=1)
        subscribe('imu', Imu, self._hear, to_imu_sample, queue_size=None)
        subscribe('odom', Odometry, self._hear, to_odometry_sample, queue_size=None)
        subscribe_wheels(self._hear)
        subscribe('battery_state', BatteryState, self._on_battery)
        try:
            from turtlebot3_msgs.msg import SensorState
            subscribe('sensor_state', SensorState, self._on_state)
        except ImportError:
            pass        # without the package the torque is not known
        for name, work in (('drive', self._drive), ('keyboard', self._talk)):
            threading.Thread(target=guarded(work), name=name, daemon=True).start()

    def _hear(self, sample):
        with self._lock:
            self._ride.hear(sample, rospy.get_time())

    def _on_battery(self, message):
        with self._lock:
            self._recording.volts.append(message.voltage)

    def _on_state(self, message):
        with self._lock:
            self._recording.torque = bool(message.torque)

    def _drive(self):
        while not (rospy.is_shutdown() or self._ride.is_over):
            with self._lock:
                order = self._ride.tick(rospy.get_time())
            if order.reset:
                self._reset.publish()
            if order.command is not None:
                self._cmd_vel.send(Twist2(*order.command))
            time.sleep(LOOK)
        self._cmd_vel.stop()

    # The person -----------------------------------------------------------------------------------

    def _talk(self):
        if not wait_until(self._is_connected, CONNECTING):
            end('no robot: {} and {} must come, and {} must be heard; rosrun tb3_labs doctor.py '
                'tells more'.format(*map(rospy.resolve_name, ('imu', 'odom', 'cmd_vel'))))
            return
        self._recording.round_trip = round_trip() if is_wall_time() else None
        print('{} steps. Put the robot into the middle of 2 m x 2 m of empty floor, and stand '
              'beside it. ANY KEY STOPS IT.'.format(self._count), flush=True)
        announced = None
        while not (self._ride.is_over or rospy.is_shutdown()):
            phase, step = self._ride.phase, self._ride.step
            if phase is Phase.ASKING:
                answer = self._terminal.number(step)
                with self._lock:
                    self._ride.answer(answer, rospy.get_time())
                continue
            if phase is Phase.ANNOUNCED and announced is not step:
                announced = step
                self._terminal.wait_for_keys()
                print('\n{} Enter: begin.'.format(step.words), flush=True)
            key = self._terminal.key()
            with self._lock:
                if key == '\n' and self._ride.phase is Phase.ANNOUNCED and phase is not (
                        Phase.RUNNING):
                    self._ride.enter(rospy.get_time())
                elif key is not None:
                    self._ride.end(KEY, rospy.get_time())
        self._terminal.restore()
        if not rospy.is_shutdown():
            self._write()
            end()

    def _is_connected(self):
        with self._lock:
            heard = self._recording.rows['imu'] and self._recording.rows['odom']
        return bool(heard) and self._cmd_vel.is_heard or rospy.is_shutdown()

    def _write(self):
        with self._lock:
            recording, model = self._recording, self._model
            found = estimates(recording, model)
            lines = findings(recording, found, model)
        print()
        for line in lines:
            print(printed(line))
        chosen = settings(found, model)
        page, numbers = (self._folder / (self._name + ending) for ending in ('.html', '.yaml'))
        page.write_text(html(self._name, lines, recording, chosen, found), encoding='utf-8')
        is_faulty = any(line.verdict == FAULT for line in lines)
        if is_faulty or set(chosen) <= {'model'}:
            why = 'mend the FAULT, then measure again' if is_faulty else 'nothing was measured'
            print('\n{}: {}. No YAML was written: {}.{}'.format(
                page, summary(lines), why,
                ' {} is of an earlier drive.'.format(numbers) if numbers.exists() else ''),
                flush=True)
            return
        numbers.write_text(yaml_text(self._name, chosen, found), encoding='utf-8')
        print('\n{}: {}. Its simulated twin: roslaunch tb3_labs fake_robot.launch '
              'params:={}'.format(page, summary(lines), numbers.resolve()), flush=True)


class Terminal:
    """Standard input, key by key; a file or a pipe serves as well. Its end counts as a key."""

    def __init__(self):
        self._input = sys.stdin.fileno()
        self._before = termios.tcgetattr(self._input) if os.isatty(self._input) else None

    def wait_for_keys(self):
        """Read single keys from now on; earlier ones are dropped."""
        if self._before:
            tty.setcbreak(self._input)
            termios.tcflush(self._input, termios.TCIFLUSH)

    def restore(self):
        """Read whole lines again, as before."""
        if self._before:
            termios.tcsetattr(self._input, termios.TCSANOW, self._before)

    def key(self):
        """The next key within a moment, '' at the end of the input, or None."""
        if not select.select([self._input], [], [], 0.02)[0]:
            return None
        return os.read(self._input, 1).decode(errors='replace')

    def number(self, step):
        """Asks the step's question until the number is valid; None for Enter alone, or the end."""
        self.restore()
        while True:
            print('? {} '.format(step.question), end='', flush=True)
            line = self._line()
            if not line.strip():
                return None
            try:
                return step.number(line)
            except ValueError as problem:
                print(problem, flush=True)

    def _line(self):
        """The line that the person types; '' at the end of the input."""
        line = b''
        while not line.endswith(b'\n'):
            sign = os.read(self._input, 1)
            if not sign:
                return ''
            line += sign
        return line.decode(errors='replace')


def round_trip():
    """Least time for a connection to the computer that publishes `imu` [s]; None if it fails."""
    master = rosgraph.Master(rospy.get_name())
    try:
        nodes = dict(master.getSystemState()[0]).get(rospy.resolve_name('imu'), [])
        address = urlparse(master.lookupNode(nodes[0]))
        times = []
        for _ in range(QUESTIONS):
            begin = time.monotonic()
            socket.create_connection((address.hostname, address.port), PATIENCE).close()
            times.append(time.monotonic() - begin)
        return min(times)
    except (OSError, IndexError, rosgraph.MasterException):
        return None
