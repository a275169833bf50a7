"""Simulated robots on the topics of real ones, and their time: real, or their own on /clock.

The messages are filled as the firmware fills them. Source: ROBOTIS OpenCR firmware 1.2.6
(turtlebot3_sensor.cpp for the covariances; it leaves those of the odometry at zero).
"""
import itertools
import threading
import time
from collections import deque
from dataclasses import replace

import rospy
from geometry_msgs.msg import PoseStamped, Twist, Vector3
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Bool, Empty, Header
from tf2_msgs.msg import TFMessage

from tb3_labs.robot.samples import ImuSample
from tb3_labs.robot.turtlebot3 import WHEEL_JOINTS
from tb3_labs.ros.conversions import frame, to_pose_stamped, to_quaternion, to_transform
from tb3_labs.ros.node import guarded
from tb3_labs.ros.rospy_internals import publish_now
from tb3_labs.ros.topics import subscribe
from tb3_labs.simulation.ros_board import BoardTopics
from tb3_labs.simulation.simulator import Simulator
from tb3_labs.simulation.simulator_config import STARTING

STEP = 1.0 / 200.0     # of the simulation [s]
TRUTH_EVERY = 4        # steps between two messages of the ground truth
#: If the computer pauses for up to this time, the robots catch up [s].
CATCH_UP = 0.5
#: If the robots publish /clock, they catch up after a pause of up to this time [s, wall clock]. On
#: /clock the pause is `speed` times as long, and passes at once: after a longer one a node would
#: find its sensors silent.
CATCH_UP_CLOCK = 0.02
#: After a stall at most this number of messages of a topic is sent, the latest ones: real queues
#: and buffers are finite, too. The number is enough for an IMU at 200 Hz in the longest stall.
MOST_HELD = 2000
GRAVITY = 9.80665  # [m/s^2]


def _diagonal(variance):
    return [variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, variance]


ORIENTATION_COVARIANCE = _diagonal(0.0025)
ANGULAR_VELOCITY_COVARIANCE = _diagonal(0.02)
LINEAR_ACCELERATION_COVARIANCE = _diagonal(0.04)


class FakeRobot:
    """One Simulator and its topics in `namespace` ('' means the node's own).

    `static_tf` is the one StaticFrames of all robots of a process: its message is latched, and the
    message of a second one would replace it. A robot with a `hidden` fault (mystery.HiddenFault)
    takes its settings from there. It has no `static_tf` and no ground truth, since both would show
    the fault.
    """

    def __init__(self, settings, namespace='', static_tf=None, hidden=None):
        prefix = namespace + '/' if namespace else ''
        self._lock = threading.Lock()    # guards the simulator
        self._hidden = hidden
        self._robot = Simulator(hidden.settings_at(0.0) if hidden else settings)
        self._sensors = SensorTopics(prefix)
        self._board = BoardTopics(prefix, self._robot.config.firmware)
        self._truth = None if hidden else publisher(prefix + 'ground_truth', PoseStamped)
        self._static_tf = static_tf
        self._origin = None
        subscribe(prefix + 'cmd_vel', Twist, self._on_command)
        subscribe(prefix + 'reset', Empty, self._on_reset)
        subscribe(prefix + 'motor_power', Bool, self._on_motor_power)

    def configure(self, settings):
        """Use other settings from now on, except those of the start."""
        with self._lock:
            own = {name: getattr(self._robot.config, name) for name in STARTING}
            self._robot.configure(replace(settings, **own))

    @property
    def is_heard(self):
        """Does any node listen to its sensors?"""
        return self._sensors.are_heard

    def tick(self, step, epoch):
        """Let one STEP pass, and send what is due; `epoch`: the robot's time 0 [s]."""
        truth_is_due = (step % TRUTH_EVERY == 0 and self._truth
                        and self._truth.get_num_connections())
        with self._lock:
            self._use_hidden_settings()
            bursts = self._robot.step_in_bursts(STEP)
            now = epoch + self._robot.now
            origin = self._robot.sensors.origin
            truth = self._robot.truth if truth_is_due else None
            self._sensors.note_wheels(self._robot.sensors)
            config, odometer = self._robot.config, self._robot.sensors.odometer
            printed = list(self._robot.printed)
            self._robot.printed.clear()
        if self._static_tf and self._origin != origin:
            self._origin = origin
            self._static_tf.send(
                to_transform(origin, 'world', self._sensors.frames['odom'], now))
        for burst in bursts:
            self._sensors.send(burst, epoch)
            if not all(isinstance(sample, ImuSample) for sample in burst):
                self._board.send(now, config, odometer.wheel_angles)
        self._board.say(printed)
        if truth is not None:
            publish_now(self._truth, to_pose_stamped(truth, 'world', now))

    def _use_hidden_settings(self):
        settings = self._hidden.settings_at(self._robot.now) if self._hidden else self._robot.config
        if settings is not self._robot.config:
            self._robot.configure(settings)

    def _on_command(self, message):
        with self._lock:
            self._robot.command(message.linear.x, message.angular.z)

    def _on_reset(self, _message):
        with self._lock:
            self._robot.reset()

    def _on_motor_power(self, message):
        with self._lock:
            self._robot.configure(replace(self._robot.config, motors_off=not message.data))


class Pacemaker:
    """Steps robots: in real time, or `speed` times as fast with a /clock that it publishes.

    The /clock runs in real time until a node listens to a robot, so that a node does not wait for
    a clock, and does not miss the start.
    """

    def __init__(self, robots, speed):
        self._robots = robots
        self._epoch = time.time()  # the robots' time 0, also with their own /clock
        has_clock = rospy.get_param('/use_sim_time', False)
        self._clock = publisher('/clock', Clock) if has_clock else None
        self._speed = speed if has_clock else 1.0
        self._thread = threading.Thread(target=guarded(self._run), name='robot', daemon=True)
        self._ending = threading.Event()  # rospy.is_shutdown() is true only after its hooks
        rospy.on_shutdown(self._end)
        self._thread.start()

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
                now = self._epoch + (step + 1) * STEP
                publish_now(self._clock, Clock(rospy.Time.from_sec(now)))
            for robot in self._robots:
                robot.tick(step, self._epoch)
            if speed != self._speed and any(robot.is_heard for robot in self._robots):
                speed = self._speed
            due += STEP / speed
            late = time.monotonic() - due
            if late < 0.0:
                time.sleep(-late)
            elif late > (CATCH_UP_CLOCK if self._clock else CATCH_UP):
                due += late
                self._epoch += 0.0 if self._clock else late


class SensorTopics:
    """Publishes samples as messages, on topics and with frames whose names begin with `prefix`.

    Its methods are called only by the thread that steps the robot.
    """

    def __init__(self, prefix):
        #: {name: name with the prefix, in this node's namespace}
        self.frames = {name: frame(prefix + name) for name in (
            'imu_link', 'odom', 'base_footprint', 'base_link')}
        self._imu = publisher(prefix + 'imu', Imu)
        self._odom = publisher(prefix + 'odom', Odometry)
        self._joints = publisher(prefix + 'joint_states', JointState)
        self._tf = publisher('/tf', TFMessage)
        self._wheels = deque(maxlen=MOST_HELD)  # of each odometry: stamp, angles, speeds

    @property
    def are_heard(self):
        """Does any node listen to the IMU or the odometry?"""
        return self._imu.get_num_connections() or self._odom.get_num_connections()

    def note_wheels(self, sensors):
        """Remember the wheels at the latest odometry of a Simulator's `sensors`. The network may
        delay this odometry; the joint states are sent together with it."""
        stamp, odometer = sensors.odometry_stamp, sensors.odometer
        if not self._wheels or self._wheels[-1][0] != stamp:
            self._wheels.append((stamp, odometer.wheel_angles, odometer.wheel_speeds))

    def send(self, burst, epoch):
        """Publish the samples of a `burst`, which arrive at one moment, by one write for each
        topic. `epoch` is the robot's time 0 [s]."""
        imu = [sample for sample in burst if isinstance(sample, ImuSample)][-MOST_HELD:]
        odometry = [sample for sample in burst if not isinstance(sample, ImuSample)][-MOST_HELD:]
        if imu and self._imu.get_num_connections():
            publish_now(self._imu, *[
                imu_message(sample, epoch + sample.stamp, self.frames['imu_link'])
                for sample in imu])
        if odometry:
            self._send_odometry(odometry, epoch)

    def _send_odometry(self, samples, epoch):
        odom, base = self.frames['odom'], self.frames['base_footprint']
        if self._tf.get_num_connections():
            publish_now(self._tf, *[
                TFMessage([to_transform(sample.pose, odom, base, epoch + sample.stamp)])
                for sample in samples])
        if self._odom.get_num_connections():
            publish_now(self._odom, *[odometry_message(sample, epoch + sample.stamp, odom, base)
                                      for sample in samples])
        if self._joints.get_num_connections():
            publish_now(self._joints, *[
                joint_message(*self._wheels_at(sample.stamp), epoch + sample.stamp,
                              self.frames['base_link']) for sample in samples])

    def _wheels_at(self, stamp):
        """Returns (angles [rad], speeds [rad/s]) at the odometry with this stamp. Ask in order of
        time."""
        while self._wheels[0][0] < stamp and len(self._wheels) > 1:
            self._wheels.popleft()
        return self._wheels[0][1:]


def publisher(topic, kind):
    """A publisher of a simulated robot: it sends at once, and has a short queue."""
    return rospy.Publisher(topic, kind, queue_size=50, tcp_nodelay=True)


def imu_message(sample, stamp, frame):
    """sensor_msgs/Imu of a robot that stands level."""
    return Imu(_header(stamp, frame), to_quaternion(sample.yaw), ORIENTATION_COVARIANCE,
               Vector3(0.0, 0.0, sample.yaw_rate), ANGULAR_VELOCITY_COVARIANCE,
               Vector3(0.0, 0.0, GRAVITY), LINEAR_ACCELERATION_COVARIANCE)


def odometry_message(sample, stamp, frame, child_frame):
    """nav_msgs/Odometry."""
    message = Odometry(header=_header(stamp, frame), child_frame_id=child_frame)
    message.pose.pose.position.x = sample.pose.x
    message.pose.pose.position.y = sample.pose.y
    message.pose.pose.orientation = to_quaternion(sample.pose.yaw)
    message.twist.twist.linear.x = sample.linear
    message.twist.twist.angular.z = sample.angular
    return message


def joint_message(angles, speeds, stamp, frame):
    """sensor_msgs/JointState of the two wheels, left one first."""
    return JointState(_header(stamp, frame), WHEEL_JOINTS, angles, speeds, [0.0, 0.0])


def _header(stamp, frame):
    return Header(stamp=rospy.Time.from_sec(stamp), frame_id=frame)


class StaticFrames:
    """Frames that move only now and then, on /tf_static: one message holds all of them.

    tf2_ros's own broadcaster (0.7.5) sends each transform in its own message, and only the last
    message is latched. With several robots, a node that starts later would know only one of them
    (test/ros/classroom.test).
    """

    def __init__(self):
        self._publisher = rospy.Publisher('/tf_static', TFMessage, queue_size=100, latch=True)
        self._transforms = {}    # by the name of the frame

    def send(self, transform):
        """Publish a TransformStamped; it replaces the one with the same child frame."""
        self._transforms[transform.child_frame_id] = transform
        self._publisher.publish(TFMessage(list(self._transforms.values())))
