"""The messages of a TurtleBot3, filled as its firmware fills them.

Source: ROBOTIS OpenCR firmware 1.2.6 (turtlebot3_sensor.cpp for the covariances; it leaves those of
the odometry at zero). Frames are given by the caller.
"""
import rospy
from geometry_msgs.msg import Vector3
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, JointState

from tb3_labs.robot.turtlebot3 import WHEEL_JOINTS
from tb3_labs.ros.conversions import to_quaternion

GRAVITY = 9.80665  # [m/s^2]


def _diagonal(variance):
    return [variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, variance]


ORIENTATION_COVARIANCE = _diagonal(0.0025)
ANGULAR_VELOCITY_COVARIANCE = _diagonal(0.02)
LINEAR_ACCELERATION_COVARIANCE = _diagonal(0.04)


def imu_message(sample, stamp, frame):
    """sensor_msgs/Imu of a robot that stands level."""
    message = Imu()
    message.header.stamp = rospy.Time.from_sec(stamp)
    message.header.frame_id = frame
    message.orientation = to_quaternion(sample.yaw)
    message.orientation_covariance = ORIENTATION_COVARIANCE
    message.angular_velocity = Vector3(0.0, 0.0, sample.yaw_rate)
    message.angular_velocity_covariance = ANGULAR_VELOCITY_COVARIANCE
    message.linear_acceleration = Vector3(0.0, 0.0, GRAVITY)
    message.linear_acceleration_covariance = LINEAR_ACCELERATION_COVARIANCE
    return message


def odometry_message(sample, stamp, frame, child_frame):
    """nav_msgs/Odometry."""
    message = Odometry()
    message.header.stamp = rospy.Time.from_sec(stamp)
    message.header.frame_id = frame
    message.child_frame_id = child_frame
    message.pose.pose.position.x = sample.pose.x
    message.pose.pose.position.y = sample.pose.y
    message.pose.pose.orientation = to_quaternion(sample.pose.yaw)
    message.twist.twist.linear.x = sample.linear
    message.twist.twist.angular.z = sample.angular
    return message


def joint_message(angles, speeds, stamp, frame):
    """sensor_msgs/JointState of the two wheels, left one first."""
    message = JointState(name=WHEEL_JOINTS, position=angles, velocity=speeds, effort=[0.0, 0.0])
    message.header.stamp = rospy.Time.from_sec(stamp)
    message.header.frame_id = frame
    return message
