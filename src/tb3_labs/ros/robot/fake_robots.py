"""Embedded robots on the topics of real ones: one, or a whole class in one process."""
import itertools
import threading
import time
from collections import deque
from dataclasses import replace

import rospy
from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Empty
from tf2_msgs.msg import TFMessage

from tb3_labs.robot.samples import ImuSample
from tb3_labs.ros.conversions import to_pose_stamped, to_transform
from tb3_labs.ros.frames import frame
from tb3_labs.ros.node import guarded, subscribe
from tb3_labs.ros.robot.messages import imu_message, joint_message, odometry_message
from tb3_labs.ros.rospy_internals import publish_together
from tb3_labs.simulation.simulator import STARTING, Simulator

STEP = 1.0 / 200.0     # of the simulation [s]
TRUTH_EVERY = 4        # steps from one ground truth to the next
CATCH_UP = 0.5         # a longer hiccup of the computer is not made up for [s]
#: Of the messages of a topic that the network held up, the newest so many are sent: real queues
#: and buffers are finite too. The longest stall of an IMU at 200 Hz fits in.
MOST_HELD = 2000


class FakeRobot:
    """One Simulator and its topics, those of `namespace` ('' for the node's own).

    `static_tf` is a tf2_ros.StaticTransformBroadcaster, one for all robots of a process: what it
    says is latched, and another one's word would take its place.
    """

    def __init__(self, settings, static_tf, namespace=''):
        prefix = namespace + '/' if namespace else ''
        self._lock = threading.Lock()
        self._robot = Simulator(settings)
        self._frames = {name: frame(prefix + name) for name in (
            'imu_link', 'odom', 'base_footprint', 'base_link')}
        self._imu = _publisher(prefix + 'imu', Imu)
        self._odom = _publisher(prefix + 'odom', Odometry)
        self._joints = _publisher(prefix + 'joint_states', JointState)
        self._tf = _publisher('/tf', TFMessage)
        self._truth = _publisher(prefix + 'ground_truth', PoseStamped)
        self._static_tf = static_tf
        self._origin = None
        self._wheels = deque(maxlen=MOST_HELD)  # by odometry: stamp, angles, speeds
        subscribe(prefix + 'cmd_vel', Twist, self._on_command)
        subscribe(prefix + 'reset', Empty, self._on_reset)

    def configure(self, settings):
        """Go on with other settings, but for what only counts at the start."""
        with self._lock:
            own = {name: getattr(self._robot.config, name) for name in STARTING}
            self._robot.configure(replace(settings, **own))

    @property
    def is_heard(self):
        """Does anybody listen to its sensors?"""
        return self._imu.get_num_connections() or self._odom.get_num_connections()

    def tick(self, step, epoch):
        """Let one STEP pass, and send what is due; `epoch` is the robot's time 0 [s]."""
        with self._lock:
            bursts = self._robot.step_in_bursts(STEP)
            now = epoch + self._robot.now
        if self._origin != self._robot.odometry_origin:
            self._origin = self._robot.odometry_origin
            self._static_tf.sendTransform(
                to_transform(self._origin, 'world', self._frames['odom'], now))
        self._note_wheels()
        for burst in bursts:
            self._send_imu([s for s in burst if isinstance(s, ImuSample)], epoch)
            self._send_odometry([s for s in burst if not isinstance(s, ImuSample)], epoch)
        if step % TRUTH_EVERY == 0 and self._truth.get_num_connections():
            with self._lock:
                truth = self._robot.truth
            self._truth.publish(to_pose_stamped(truth, 'world', now))

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

    def _send_imu(self, samples, epoch):
        if self._imu.get_num_connections():
            _publish(self._imu, [
                imu_message(sample, epoch + sample.stamp, self._frames['imu_link'])
                for sample in samples[-MOST_HELD:]])

    def _send_odometry(self, samples, epoch):
        samples = samples[-MOST_HELD:]
        odom, base = self._frames['odom'], self._frames['base_footprint']
        _publish(self._tf, [
            TFMessage([to_transform(sample.pose, odom, base, epoch + sample.stamp)])
            for sample in samples])
        if self._odom.get_num_connections():
            _publish(self._odom, [odometry_message(sample, epoch + sample.stamp, odom, base)
                                  for sample in samples])
        if self._joints.get_num_connections():
            _publish(self._joints, [
                joint_message(*self._wheels_at(sample.stamp), epoch + sample.stamp,
                              self._frames['base_link']) for sample in samples])

    def _note_wheels(self):
        """The wheels as of each odometry, which the network may hold up."""
        stamp = self._robot.odometry_stamp
        if not self._wheels or self._wheels[-1][0] != stamp:
            self._wheels.append((stamp, self._robot.wheel_angles, self._robot.wheel_speeds))

    def _wheels_at(self, stamp):
        """(angles [rad], speeds [rad/s]) as of the odometry with this stamp. Ask in order."""
        while self._wheels[0][0] < stamp and len(self._wheels) > 1:
            self._wheels.popleft()
        return self._wheels[0][1:]


class Pacemaker:
    """Steps robots in time: in real time, or `speed` times as fast on a clock of their own, which
    it publishes. That runs in real time until somebody listens, so that nobody waits for a clock
    and nobody misses a start.
    """

    def __init__(self, robots, speed):
        self._robots = robots
        self._epoch = time.time()  # of the robots' time 0, also where the clock is their own
        self._clock = None
        self._speed = 1.0
        if rospy.get_param('/use_sim_time', False):
            self._clock, self._speed = _publisher('/clock', Clock), speed
        self._thread = threading.Thread(target=guarded(self._run), daemon=True)
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
                self._clock.publish(rospy.Time.from_sec(self._epoch + (step + 1) * STEP))
            for robot in self._robots:
                robot.tick(step, self._epoch)
            if speed != self._speed and any(robot.is_heard for robot in self._robots):
                speed = self._speed
            due += STEP / speed
            late = time.monotonic() - due
            if late < 0.0:
                time.sleep(-late)
            elif late > CATCH_UP:
                due += late
                self._epoch += 0.0 if self._clock else late


def _publish(publisher, messages):
    """Messages that arrive at one moment are one write."""
    if len(messages) > 1:
        publish_together(publisher, messages)
    elif messages:
        publisher.publish(messages[0])


def _publisher(topic, kind):
    return rospy.Publisher(topic, kind, queue_size=50, tcp_nodelay=True)
