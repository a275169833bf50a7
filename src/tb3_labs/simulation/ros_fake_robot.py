"""Simulates a robot on the topics of a real robot, in real time or by its own /clock.

The messages have the same values as messages of ROBOTIS OpenCR firmware 1.2.6. The covariances of
the IMU are from its file turtlebot3_sensor.cpp. The covariances of the odometry are zero.
"""
import itertools
import math
import os
import threading
import time
from contextlib import suppress

import rospy
from geometry_msgs.msg import PoseStamped, Twist, Vector3
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Empty, Header
from tf2_msgs.msg import TFMessage

from tb3_labs.robot.samples import ImuSample
from tb3_labs.robot.turtlebot3 import WHEEL_JOINTS
from tb3_labs.ros.conversions import (
    TRUTH_PIPE, frame_name, to_pose_stamped, to_quaternion, to_transform, to_twist)
from tb3_labs.ros.node import guarded
from tb3_labs.ros.rospy_internals import make_writes_immediate, publish_together
from tb3_labs.simulation.sensors import MAX_SAMPLES
from tb3_labs.simulation.simulator import Simulator

SIMULATION_STEP = 1.0 / 200.0  # [s]
STEPS_PER_TRUTH = 4            # number of steps between two messages of the ground truth
#: If a pause of the computer is longer than this time [s], the robot does not catch up.
MAX_CATCH_UP_TIME = 0.5
#: The same with a /clock, because after a larger jump of /clock the sensors would seem silent.
MAX_CATCH_UP_TIME_ON_CLOCK = 0.02
GRAVITY = 9.80665            # [m/s^2]
ROLL = math.radians(0.7)     # roll and pitch [rad] of the board in a recorded robot
PITCH = math.radians(0.4)


def _diagonal(variance):
    return [variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, variance]


ORIENTATION_COVARIANCE = _diagonal(0.0025)
ANGULAR_VELOCITY_COVARIANCE = _diagonal(0.02)
LINEAR_ACCELERATION_COVARIANCE = _diagonal(0.04)
#: The acceleration (x, y, z) [m/s^2] that a robot at rest measures.
ACCELERATION_AT_REST = (
    -GRAVITY * math.sin(PITCH), GRAVITY * math.sin(ROLL) * math.cos(PITCH),
    GRAVITY * math.cos(ROLL) * math.cos(PITCH))


class FakeRobot:
    """Connects a Simulator to its topics. If `hidden_fault` is a mystery_robot.HiddenFault, its
    settings replace `settings`. Then neither /tf_static nor the ground truth is published, because
    both would show the fault. If the environment variable TRUTH_PIPE is set, the robot writes its
    true poses to this pipe, and not to a topic."""

    def __init__(self, settings, hidden_fault=None):
        self._lock = threading.Lock()    # guards the simulator
        self._hidden_fault = hidden_fault
        self._simulator = Simulator(hidden_fault.settings_at(0.0) if hidden_fault else settings)
        self._sensors = SensorTopics()
        pipe_path = os.environ.get(TRUTH_PIPE)
        self._pipe = TruthPipe(pipe_path) if pipe_path else None
        self._truth_topic, self._static_tf = None, None
        if not hidden_fault:
            self._static_tf = make_publisher('/tf_static', TFMessage, latch=True)
            if not pipe_path:
                self._truth_topic = make_publisher('ground_truth', PoseStamped)
        self._world_T_odom = None    # the pose on /tf_static
        options = dict(queue_size=1, tcp_nodelay=True)
        rospy.Subscriber('cmd_vel', Twist, guarded(self._on_command), **options)
        rospy.Subscriber('reset', Empty, guarded(self._on_reset), **options)

    def configure(self, settings):
        """From now on use all fields of `settings` except the FIXED_FIELDS."""
        with self._lock:
            self._simulator.configure(settings)

    def tick(self, step, time_zero):
        """Let one SIMULATION_STEP pass, and publish the messages that are due. `step` is the number
        of this step. `time_zero` is the ROS time [s] at which the simulator's time is 0."""
        is_truth_due = step % STEPS_PER_TRUTH == 0 and self._has_truth_readers()
        with self._lock:
            if self._hidden_fault:
                self._simulator.configure(self._hidden_fault.settings_at(self._simulator.now))
            bursts = self._simulator.step_in_bursts(SIMULATION_STEP)
            now = time_zero + self._simulator.now
            world_T_odom = self._simulator.sensors.world_T_odom
            truth = self._simulator.truth if is_truth_due else None
        if self._static_tf and self._world_T_odom != world_T_odom:
            self._world_T_odom = world_T_odom
            self._static_tf.publish(TFMessage([
                to_transform(world_T_odom, 'world', frame_name('odom'), now)]))
        for burst in bursts:
            self._sensors.send(burst, time_zero, self._simulator.sensors.wheel_readings)
        if truth is None:
            return
        if self._pipe:
            self._pipe.write(truth)
        else:
            self._truth_topic.publish(to_pose_stamped(truth, 'world', now))

    def _has_truth_readers(self):
        if self._pipe:
            return self._pipe.open_if_read()
        return self._truth_topic is not None and self._truth_topic.get_num_connections() > 0

    def _on_command(self, message):
        with self._lock:
            self._simulator.command(message.linear.x, message.angular.z)

    def _on_reset(self, _message):
        with self._lock:
            self._simulator.reset()


def start_stepping(robot, speed):
    """Step a FakeRobot in a thread. If use_sim_time is set, publish a /clock that is `speed` times
    as fast as real time. Without use_sim_time, `speed` has no effect."""
    clock = make_publisher('/clock', Clock) if rospy.get_param('/use_sim_time', False) else None
    pace = speed if clock else 1.0
    threading.Thread(target=guarded(step_forever), args=(robot, clock, pace),
                     name='robot', daemon=True).start()


def step_forever(robot, clock, pace):
    """Step `robot` without end, `pace` times as fast as real time."""
    max_catch_up_time = MAX_CATCH_UP_TIME_ON_CLOCK if clock else MAX_CATCH_UP_TIME
    due = time.monotonic()    # the time of the next step
    time_zero = time.time()   # the ROS time at which the simulator's time is 0
    for step in itertools.count():
        if clock:
            clock.publish(Clock(rospy.Time.from_sec(time_zero + (step + 1) * SIMULATION_STEP)))
        robot.tick(step, time_zero)
        due += SIMULATION_STEP / pace
        lateness = time.monotonic() - due
        if lateness < 0.0:
            time.sleep(-lateness)
        elif lateness > max_catch_up_time:    # drop the missed time
            due += lateness
            if not clock:
                time_zero += lateness


class TruthPipe:
    """Writes true poses into a named pipe, which the program that reads the poses has made."""

    def __init__(self, path):
        self._path = path
        self._pipe = -1

    def open_if_read(self):
        """Open the pipe if a program reads it. Returns True if the pipe is open."""
        if self._pipe < 0:
            with suppress(OSError):    # no program reads the pipe yet
                self._pipe = os.open(self._path, os.O_WRONLY | os.O_NONBLOCK)
        return self._pipe >= 0

    def write(self, pose):
        """Write a pose. If the pipe is full, drop the pose, because the robot must not wait."""
        with suppress(OSError):
            os.write(self._pipe, f'{pose.x:.9g} {pose.y:.9g} {pose.yaw:.9g}\n'.encode())


class SensorTopics:
    """Publishes samples as messages, in the thread that steps the robot."""

    def __init__(self):
        self._imu = make_publisher('imu', Imu)
        self._odom = make_publisher('odom', Odometry)
        self._joints = make_publisher('joint_states', JointState)
        self._tf = make_publisher('/tf', TFMessage)

    def send(self, burst, time_zero, wheel_readings):
        """Publish the samples of a `burst` by one write for each topic, so that they arrive
        together. Remove older `wheel_readings`. For `time_zero` see :meth:`FakeRobot.tick`."""
        imu, tf, odometry, joints = [], [], [], []
        for sample in burst[-MAX_SAMPLES:]:
            stamp = time_zero + sample.stamp
            if isinstance(sample, ImuSample):
                imu.append(imu_message(sample, stamp))
                continue
            odometry.append(odometry_message(sample, stamp))
            tf.append(TFMessage([to_transform(
                sample.pose, frame_name('odom'), frame_name('base_footprint'), stamp)]))
            reading = _reading_at(wheel_readings, sample.stamp)
            joints.append(joint_message(reading, stamp))
        for publisher, messages in ((self._imu, imu), (self._tf, tf), (self._odom, odometry),
                                    (self._joints, joints)):
            if messages and publisher.get_num_connections():
                publish_together(publisher, messages)


def _reading_at(wheel_readings, stamp):
    """Remove the readings before `stamp` [s]. Returns the first of the remaining readings."""
    while wheel_readings[0].stamp < stamp and len(wheel_readings) > 1:
        wheel_readings.popleft()
    return wheel_readings[0]


def make_publisher(topic, message_type, **options):
    """Returns a publisher that sends each message immediately, and not from a queue."""
    publisher = rospy.Publisher(topic, message_type, queue_size=50, tcp_nodelay=True, **options)
    make_writes_immediate(publisher, max_waiting=50)
    return publisher


def imu_message(sample, stamp):
    """Returns the sensor_msgs/Imu of a robot on a level floor."""
    return Imu(header=_header(stamp, 'imu_link'),
               orientation=to_quaternion(sample.yaw, ROLL, PITCH),
               orientation_covariance=ORIENTATION_COVARIANCE,
               angular_velocity=Vector3(0.0, 0.0, sample.yaw_rate),
               angular_velocity_covariance=ANGULAR_VELOCITY_COVARIANCE,
               linear_acceleration=Vector3(*ACCELERATION_AT_REST),
               linear_acceleration_covariance=LINEAR_ACCELERATION_COVARIANCE)


def odometry_message(sample, stamp):
    stamped = to_pose_stamped(sample.pose, frame_name('odom'), stamp)
    message = Odometry(header=stamped.header, child_frame_id=frame_name('base_footprint'))
    message.pose.pose = stamped.pose
    message.twist.twist = to_twist(sample.linear, sample.angular)
    return message


def joint_message(reading, stamp):
    """Returns the sensor_msgs/JointState of the two wheels, the left wheel first."""
    return JointState(header=_header(stamp, 'base_link'), name=WHEEL_JOINTS,
                      position=reading.angles, velocity=reading.speeds, effort=[0.0, 0.0])


def _header(stamp, frame):
    return Header(stamp=rospy.Time.from_sec(stamp), frame_id=frame_name(frame))
