"""The samples of a simulated robot as messages, filled as the firmware fills them.

Source: ROBOTIS OpenCR firmware 1.2.6 (turtlebot3_sensor.cpp for the covariances; it leaves those of
the odometry at zero).
"""
import math
from collections import deque
from io import BytesIO

import rospy
from geometry_msgs.msg import Vector3
from nav_msgs.msg import Odometry
from rospy.msg import serialize_message
from sensor_msgs.msg import Imu, JointState, MagneticField
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from tb3_labs.robot.samples import ImuSample
from tb3_labs.robot.turtlebot3 import WHEEL_JOINTS
from tb3_labs.ros.conversions import frame, to_quaternion, to_transform

#: After a stall at most this number of messages of a topic is sent, the latest ones: real queues
#: and buffers are finite, too. The number is enough for an IMU at 200 Hz in the longest stall.
MOST_HELD = 2000
GRAVITY = 9.80665  # [m/s^2]
#: The board lies askew by these angles, which were recorded [rad].
ROLL, PITCH = math.radians(0.7), math.radians(0.4)
#: The earth's magnetic field: towards the yaw 0 of the IMU, and down [T].
MAGNETIC_NORTH, MAGNETIC_DOWN = 20e-6, 43e-6


def _diagonal(variance):
    return [variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, variance]


ORIENTATION_COVARIANCE = _diagonal(0.0025)
ANGULAR_VELOCITY_COVARIANCE = _diagonal(0.02)
LINEAR_ACCELERATION_COVARIANCE = _diagonal(0.04)
MAGNETIC_FIELD_COVARIANCE = _diagonal(0.0048)
#: What the accelerometer shows at rest [m/s^2].
UPWARDS = (-GRAVITY * math.sin(PITCH), GRAVITY * math.sin(ROLL) * math.cos(PITCH),
            GRAVITY * math.cos(ROLL) * math.cos(PITCH))


class SensorTopics:
    """Publishes samples as messages. Its methods are called only by the thread that steps the
    robot."""

    def __init__(self):
        #: {name: name in this node's namespace}
        self.frames = {name: frame(name) for name in (
            'imu_link', 'mag_link', 'odom', 'base_footprint', 'base_link')}
        self._imu = publisher('imu', Imu)
        self._magnetic_field = publisher('magnetic_field', MagneticField)
        self._odom = publisher('odom', Odometry)
        self._joints = publisher('joint_states', JointState)
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
            publish_together(self._imu, [
                imu_message(sample, epoch + sample.stamp, self.frames['imu_link'])
                for sample in imu])
        if imu and self._magnetic_field.get_num_connections():
            publish_together(self._magnetic_field, [
                magnetic_message(sample, epoch + sample.stamp, self.frames['mag_link'])
                for sample in imu])
        if odometry:
            self._send_odometry(odometry, epoch)

    def _send_odometry(self, samples, epoch):
        odom, base = self.frames['odom'], self.frames['base_footprint']
        if self._tf.get_num_connections():
            publish_together(self._tf, [
                TFMessage([to_transform(sample.pose, odom, base, epoch + sample.stamp)])
                for sample in samples])
        if self._odom.get_num_connections():
            publish_together(self._odom, [
                odometry_message(sample, epoch + sample.stamp, odom, base) for sample in samples])
        if self._joints.get_num_connections():
            publish_together(self._joints, [
                joint_message(*self._wheels_at(sample.stamp), epoch + sample.stamp,
                              self.frames['base_link']) for sample in samples])

    def _wheels_at(self, stamp):
        """Returns (angles [rad], speeds [rad/s]) at the odometry with this stamp. Ask in order of
        time."""
        while self._wheels[0][0] < stamp and len(self._wheels) > 1:
            self._wheels.popleft()
        return self._wheels[0][1:]


def publisher(topic, kind, **options):
    """A publisher of a simulated robot: it sends at once, and has a short queue."""
    return rospy.Publisher(topic, kind, queue_size=50, tcp_nodelay=True, **options)


def imu_message(sample, stamp, frame):
    """sensor_msgs/Imu of a robot on a level floor."""
    return Imu(_header(stamp, frame), to_quaternion(sample.yaw, ROLL, PITCH),
               ORIENTATION_COVARIANCE,
               Vector3(0.0, 0.0, sample.yaw_rate), ANGULAR_VELOCITY_COVARIANCE,
               Vector3(*UPWARDS), LINEAR_ACCELERATION_COVARIANCE)


def magnetic_message(sample, stamp, frame):
    """sensor_msgs/MagneticField of the same robot."""
    return MagneticField(
        _header(stamp, frame), Vector3(MAGNETIC_NORTH * math.cos(sample.yaw),
                                       -MAGNETIC_NORTH * math.sin(sample.yaw), -MAGNETIC_DOWN),
        MAGNETIC_FIELD_COVARIANCE)


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


def publish_together(publisher, messages):
    """Publish messages by one write to each subscriber, as a network delivers what it has delayed:
    a subscriber with queue_size=1 finds all of them in one read, and drops all but the last.

    ``publish()`` writes each message for itself (`impl`, the queues' `write_data`;
    test/ros/fake_robot.test).
    """
    topic, data = publisher.impl, BytesIO()
    topic.acquire()
    try:
        for message in messages:
            topic.seq += 1
            serialize_message(data, topic.seq, message)
        for connection in topic.connections:
            try:
                connection.write_data(data.getvalue())
            except (rospy.exceptions.TransportException, OSError):
                connection.close()      # this subscriber is gone; publish() does the same
    finally:
        topic.release()
