"""The robot of the stage, and its mouse or gamepad.

The robot's motion and the node's commands are recorded. The marker turns the robot, and plays the
mouse or the gamepad.
"""
import math
import os
import threading
import time
from bisect import bisect_left

import numpy as np
import rosgraph
import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Imu

from tb3_labs.geometry.angles import clamp, continuous, difference
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.trial.observation import CMD_VEL, IMU_TOPIC, ODOM
from tb3_labs.report.bag.messages import LEVELS
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.conversions import TRUTH_PIPE, to_odometry_sample, to_twist
from tb3_labs.ros.sensor_topics import to_imu_sample
from tb3_labs.ros.rospy_internals import connection_of, note_connections, sender_of
from tb3_labs.ros.topics import subscribe

#: The robot's name, by which its settings are found.
ROBOT = 'turtlebot3'
#: Its settings that the marker itself switches.
SWITCHES = IMU_SWITCH, ODOM_SWITCH = 'imu_silent', 'odom_silent'
#: At most this many commands, odd commands and log lines of a node are recorded, of each line at
#: most LINE_LENGTH characters.
MOST_COMMANDS, MOST_ODD, MOST_LINES, LINE_LENGTH = 40000, 1000, 1000, 300
#: A robot rests if it moves less than REST_WAY [m] and turns less than REST_TURN [rad] within
#: REST_TIME [s].
REST_WAY, REST_TURN, REST_TIME = 0.002, 0.005, 0.4
#: The robot rests within this time after its last command [s].
RESTS = 2.0
#: A movement has lasted this long before something happens to it [s].
WELL_UNDER_WAY = 0.5
#: The output and the messages of a node arrive within this time [s].
UNDER_WAY = 0.3


class Recorder:
    """Writes into an Observation, from other threads: the robot's true poses and its sensors, the
    node's commands and log lines.

    Times are seconds since the recorder was made. RuntimeError if the robot does not run.
    """

    def __init__(self, observation):
        self._observation = observation
        self._zero, self._lock = rospy.get_time(), threading.Lock()
        #: The addresses of the programs that commanded the robot, the latest first.
        self._drivers = []
        self._imu = None
        threading.Thread(
            target=self._read_truth, args=(os.environ[TRUTH_PIPE],), daemon=True).start()
        note_connections()
        subscribe(CMD_VEL, Twist, self._on_command, queue_size=None)
        subscribe(IMU_TOPIC, Imu, self._on_imu, to_imu_sample)
        subscribe(ODOM, Odometry, self._on_odometry, to_odometry_sample)
        subscribe('/rosout', Log, self._on_log, queue_size=None)
        if not wait_until(lambda: observation.truth, 60.0):     # also on a busy computer
            raise RuntimeError('the simulated robot does not run')
        #: The robot's address.
        self.robot = rosgraph.Master(rospy.get_name()).lookupNode('/' + ROBOT)

    def _read_truth(self, path):
        truth = self._observation.truth
        os.mkfifo(path, 0o600)
        with open(path, 'rb') as pipe:
            os.remove(path)     # the robot has it: nobody else can open it
            for line in pipe:
                x, y, yaw = map(float, line.split())
                with self._lock:
                    yaw = continuous(yaw, truth[-1][3]) if truth else yaw
                    truth.append([self.now, x, y, yaw])

    def _on_command(self, message):
        entry = [self.now, message.linear.x, message.angular.z]
        header = connection_of(message)
        if header['process'] == rospy.get_node_uri():
            return      # the marker's own
        seen = self._observation
        with self._lock:
            self._note_driver(header)
            if not (math.isfinite(entry[1]) and math.isfinite(entry[2])):
                seen.lose('commands that are not finite numbers')
                seen.odd += [[entry[0], '{:g} m/s and {:g} rad/s'.format(*entry[1:])]] * (
                    len(seen.odd) < MOST_ODD)
                return
            same = seen.commands and seen.commands[-1][1:] == entry[1:]
            if same and entry[0] - seen.commands[-1][0] < 0.04:     # [s]
                return
            if len(seen.commands) < MOST_COMMANDS:
                seen.commands.append(entry)
            else:
                seen.lose('commands after the first {}'.format(MOST_COMMANDS))

    def _note_driver(self, header):
        process = header['process']
        if process in self._drivers[1:]:    # it had been followed by another one
            self._observation.drivers = sorted({*self._observation.drivers, sender_of(header)})
        self._drivers = [process] + [other for other in self._drivers if other != process]

    def _on_imu(self, sample):
        self._imu = sample

    def _on_odometry(self, sample):
        pose, imu = sample.pose, self._imu
        if imu is not None:
            with self._lock:
                self._observation.sensed.append([round(number, 5) for number in (
                    self.now, pose.x, pose.y, pose.yaw, sample.linear, imu.yaw, imu.yaw_rate)])

    def _on_log(self, line):
        log = self._observation.log
        if line.name not in (rospy.get_name(), '/' + ROBOT) and len(log) < MOST_LINES:
            with self._lock:
                log.append([self.now, LEVELS.get(line.level, ''), line.name,
                            line.msg[:LINE_LENGTH]])

    @property
    def now(self):
        """Seconds since the recorder was made."""
        return rospy.get_time() - self._zero

    def hand_to(self, keep):
        """Call ``keep(observation)`` while nothing is written into the observation."""
        with self._lock:
            keep(self._observation)

    def note_own_move(self, begin):
        """Note that the marker has moved the robot since `begin`."""
        with self._lock:
            self._observation.own_moves.append([begin, self.now])

    @property
    def pose(self):
        """The robot's true pose, a Pose2; its yaw is continuous."""
        with self._lock:
            return Pose2(*self._observation.truth[-1][1:])

    @property
    def heading_deg(self):
        """The robot's true heading [deg], continuous."""
        return math.degrees(self.pose.yaw)

    def commands_since(self, begin):
        """The node's commands since `begin`: [time, linear, angular]."""
        commands = self._observation.commands
        with self._lock:
            return commands[bisect_left(commands, [begin]):]

    def moves(self, begin):
        """Has the node commanded a movement since `begin`?"""
        return any(linear or angular for _, linear, angular in self.commands_since(begin))

    def rests(self, without_command=0.0):
        """Has it rested for REST_TIME, without a command to move for `without_command` [s]?"""
        if without_command and self.moves(self.now - without_command):
            return False
        truth = self._observation.truth
        with self._lock:
            recent = np.array(truth[bisect_left(truth, [self.now - REST_TIME]):])
        if len(recent) < 5:     # too few to tell
            return False
        _, x, y, yaw = (recent - recent[0]).T
        return bool(np.hypot(x, y).max() < REST_WAY and np.abs(yaw).max() < REST_TURN)


class RobotHand:
    """Turns the robot by commands of the marker, which are not recorded as the node's."""

    def __init__(self, recorder):
        self._recorder = recorder
        self._wheels = rospy.Publisher(CMD_VEL, Twist, queue_size=1)

    def _move(self, command, seconds):
        """Move the robot by ``command()``, (linear, angular), until this is None, for `seconds` [s]
        at most. The last command is zero, also after an interruption."""
        begin, deadline = self._recorder.now, time.monotonic() + seconds
        try:
            for speeds in iter(command, None):
                if time.monotonic() >= deadline:
                    break
                self._wheels.publish(to_twist(*speeds))
                time.sleep(0.03)    # a control period of the robot
        finally:
            self._wheels.publish(to_twist(0.0, 0.0))
            self._recorder.note_own_move(begin)

    def face(self, heading_deg):
        """Turn the robot the short way to a heading [deg], in at most 8 s. Does it rest
        afterwards?"""
        def command():
            error = difference(math.radians(heading_deg), self._recorder.pose.yaw)
            speed = clamp(3.0 * abs(error), 0.1, 1.5)   # [rad/s], by the error in [rad]
            return (0.0, math.copysign(speed, error)) if abs(error) > 0.01 else None
        self._move(command, 8.0)
        return wait_until(self._recorder.rests, RESTS)

    def leave_origin(self):
        """Drive the robot forward: at the odometry's origin many a wrong frame looks right."""
        self._move(lambda: (0.2, 0.0), 2.5)     # 0.2 m/s for 2.5 s


class Repeater:
    """Repeats the latest message on a topic, as the driver of a mouse or a gamepad does; until the
    end of a ``with`` statement."""

    def __init__(self, topic, kind):
        self._message, self._closed = None, False
        self._publisher = rospy.Publisher(topic, kind, queue_size=1, tcp_nodelay=True)
        threading.Thread(target=self._repeat, daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *problem):
        self._message, self._closed = None, True

    def hold(self, message):
        """Send this message from now on. None: send nothing, like a device that is unplugged."""
        self._message = message
        self._send(message)

    def wait_until_heard(self):
        """Wait until a node is connected and has heard the message that is held.

        A node may ignore a new pad that has not been at rest for a moment (this package's gamepad:
        0.3 s).
        """
        wait_until(self._publisher.get_num_connections, 1.0)
        time.sleep(0.45)

    def _send(self, message):
        if message is not None:
            self._publisher.publish(message)

    def _repeat(self):
        while not (self._closed or rospy.is_shutdown()):
            self._send(self._message)
            time.sleep(0.05)    # 20 messages in a second
