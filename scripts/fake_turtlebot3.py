#!/usr/bin/env python3
"""The embedded robot: behaves as a TurtleBot3 with its firmware, on the same topics.

Subscribes
    cmd_vel       geometry_msgs/Twist          linear.x [m/s], angular.z [rad/s]
    reset         std_msgs/Empty               the firmware's own reset (see tb3_labs.simulator)
Publishes (frames are in the node's namespace: robot3/odom in /robot3)
    imu           sensor_msgs/Imu              frame imu_link, ~imu_rate
    odom          nav_msgs/Odometry            odom -> base_footprint, ~odom_rate
    joint_states  sensor_msgs/JointState       with each odometry
    /tf           tf2_msgs/TFMessage           odom -> base_footprint, with each odometry
    /tf_static    tf2_msgs/TFMessage           world -> odom: where the odometry's origin truly is
    ground_truth  geometry_msgs/PoseStamped    frame world, 50 Hz: for tests, never for control
    /clock        rosgraph_msgs/Clock          with use_sim_time, 200 per simulated second
Parameters
    ~speed        times real time, with use_sim_time (1). Until somebody listens to imu or odom,
                  time runs at 1, so that nobody waits for a clock and nobody misses a start
    ~model        burger, waffle, waffle_pi (TURTLEBOT3_MODEL in the environment, else burger)
    all others    fields of tb3_labs.simulator.SimulatorConfig, with unit, bounds and default;
                  those that are no matter of the start change while it runs:
                  rosrun dynamic_reconfigure dynparam set /turtlebot3 imu_silent true
"""
import itertools
import threading
import time
from dataclasses import dataclass, replace

import rospy
from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Empty
from tf2_msgs.msg import TFMessage
from tf2_ros import StaticTransformBroadcaster

from tb3_labs.config import Config, setting
from tb3_labs.ros.conversions import to_pose_stamped, to_transform
from tb3_labs.ros.frames import frame
from tb3_labs.ros.live import LiveSettings
from tb3_labs.ros.node import guarded, run, subscribe
from tb3_labs.ros.parameters import read_config, read_model
from tb3_labs.ros.robot_messages import imu_message, joint_message, odometry_message
from tb3_labs.sensors import ImuSample
from tb3_labs.simulator import STARTING, Simulator, SimulatorConfig

STEP = 1.0 / 200.0     # of the simulation [s]
TRUTH_EVERY = 4        # steps from one ground truth to the next
CATCH_UP = 0.5         # a longer hiccup of the computer is not made up for [s]


@dataclass(frozen=True)
class PaceConfig(Config):
    speed: float = setting(1.0, 'times real time, with use_sim_time', low=0.1, high=20.0)


class FakeTurtlebot3:
    def __init__(self):
        settings, pace = read_config(SimulatorConfig, PaceConfig)
        settings = replace(settings, model=read_model().name)
        self._lock = threading.Lock()
        self._robot = Simulator(settings)
        self._frames = {name: frame(name) for name in (
            'imu_link', 'odom', 'base_footprint', 'base_link')}
        self._epoch = time.time()  # of the robot's time 0, also where the clock is its own

        self._imu = self._publisher('imu', Imu)
        self._odom = self._publisher('odom', Odometry)
        self._joints = self._publisher('joint_states', JointState)
        self._tf = self._publisher('/tf', TFMessage)
        self._truth = self._publisher('ground_truth', PoseStamped)
        self._origin_tf = StaticTransformBroadcaster()
        self._origin = None
        self._clock = None
        self._speed = 1.0
        if rospy.get_param('/use_sim_time', False):
            self._clock = self._publisher('/clock', Clock)
            self._speed = pace.speed

        self._live = LiveSettings(settings, self._on_settings, fixed=STARTING)
        subscribe('cmd_vel', Twist, self._on_command)
        subscribe('reset', Empty, self._on_reset)
        self._thread = threading.Thread(target=guarded(self._run), daemon=True)
        self._ending = threading.Event()  # rospy.is_shutdown() is true only after its hooks
        rospy.on_shutdown(self._end)
        self._thread.start()

    def _end(self):
        self._ending.set()
        if threading.current_thread() is not self._thread:
            self._thread.join()

    @staticmethod
    def _publisher(topic, kind):
        return rospy.Publisher(topic, kind, queue_size=50, tcp_nodelay=True)

    def _on_command(self, message):
        try:
            with self._lock:
                self._robot.command(message.linear.x, message.angular.z)
        except ValueError as problem:
            rospy.logwarn_throttle(1.0, 'cmd_vel dropped: {}'.format(problem))

    def _on_reset(self, _message):
        with self._lock:
            self._robot.reset()
        rospy.loginfo('reset: calibrating the gyro, then zeroing the odometry')

    def _on_settings(self, settings):
        with self._lock:
            self._robot.configure(settings)

    def _run(self):
        due = time.monotonic()
        speed = 1.0
        for step in itertools.count():
            if self._ending.is_set():
                return
            self._tick(step)
            if speed != self._speed and self._is_heard():
                speed = self._speed
            due += STEP / speed
            late = time.monotonic() - due
            if late < 0.0:
                time.sleep(-late)
            elif late > CATCH_UP:
                due += late
                self._epoch += 0.0 if self._clock else late

    def _is_heard(self):
        return self._imu.get_num_connections() or self._odom.get_num_connections()

    def _tick(self, step):
        with self._lock:
            samples = self._robot.step(STEP)
            now = self._epoch + self._robot.now
        if self._clock:
            self._clock.publish(rospy.Time.from_sec(now))
        if self._origin != self._robot.odometry_origin:
            self._origin = self._robot.odometry_origin
            self._origin_tf.sendTransform(
                to_transform(self._origin, 'world', self._frames['odom'], now))
        for sample in samples:
            if isinstance(sample, ImuSample):
                self._send_imu(sample)
            else:
                self._send_odometry(sample)
        if step % TRUTH_EVERY == 0 and self._truth.get_num_connections():
            with self._lock:
                truth = self._robot.truth
            self._truth.publish(to_pose_stamped(truth, 'world', now))

    def _send_imu(self, sample):
        if self._imu.get_num_connections():
            self._imu.publish(imu_message(sample, self._epoch + sample.stamp,
                                          self._frames['imu_link']))

    def _send_odometry(self, sample):
        stamp = self._epoch + sample.stamp
        odom, base = self._frames['odom'], self._frames['base_footprint']
        self._tf.publish([to_transform(sample.pose, odom, base, stamp)])
        if self._odom.get_num_connections():
            self._odom.publish(odometry_message(sample, stamp, odom, base))
        if self._joints.get_num_connections():
            self._joints.publish(joint_message(self._robot.wheel_angles, self._robot.wheel_speeds,
                                               stamp, self._frames['base_link']))


if __name__ == '__main__':
    run('turtlebot3', FakeTurtlebot3)
