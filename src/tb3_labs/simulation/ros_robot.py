"""Simulated robots on the topics of real ones, and their time: real, or their own on /clock."""
import itertools
import threading
import time
from dataclasses import replace

import rospy
from geometry_msgs.msg import PoseStamped, Twist
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Empty
from tf2_msgs.msg import TFMessage

from tb3_labs.ros.conversions import to_pose_stamped, to_transform
from tb3_labs.ros.node import guarded
from tb3_labs.ros.rospy_internals import publish_now
from tb3_labs.ros.topics import subscribe
from tb3_labs.simulation.ros_sensors import SensorTopics, publisher
from tb3_labs.simulation.simulator import Simulator
from tb3_labs.simulation.simulator_config import STARTING

STEP = 1.0 / 200.0     # of the simulation [s]
TRUTH_EVERY = 4        # steps between two messages of the ground truth
#: A longer pause of the computer is not made up for [s].
CATCH_UP = 0.5
#: The same with a /clock of its own [s, wall clock]. On that /clock it is `speed` times as long,
#: and passes at once: a node that hears of it too late finds its sensors silent.
CATCH_UP_CLOCK = 0.02


class StaticFrames:
    """Frames that move only now and then, on /tf_static: one message holds all of them.

    tf2_ros's own broadcaster (0.7.5) sends each transform in a message of its own, of which only
    the last one is latched: of several robots, a node that comes later would know a single one
    (test/ros/classroom.test).
    """

    def __init__(self):
        self._publisher = rospy.Publisher('/tf_static', TFMessage, queue_size=100, latch=True)
        self._transforms = {}    # by the name of the frame

    def send(self, transform):
        """Add a TransformStamped, or replace that of its child frame."""
        self._transforms[transform.child_frame_id] = transform
        self._publisher.publish(TFMessage(list(self._transforms.values())))


class FakeRobot:
    """One Simulator and its topics, those of `namespace` ('' for the node's own).

    `static_tf` is a StaticFrames, one for all robots of a process: its message is latched, and that
    of a second one would replace it. A robot with a `hidden` fault (mystery.HiddenFault) takes its
    settings from that. It has no `static_tf` and no ground truth: both would show the fault.
    """

    def __init__(self, settings, namespace='', static_tf=None, hidden=None):
        prefix = namespace + '/' if namespace else ''
        self._lock = threading.Lock()    # guards the simulator
        self._hidden = hidden
        self._robot = Simulator(hidden.settings_at(0.0) if hidden else settings)
        self._sensors = SensorTopics(prefix)
        self._truth = None if hidden else publisher(prefix + 'ground_truth', PoseStamped)
        self._static_tf = static_tf
        self._origin = None
        subscribe(prefix + 'cmd_vel', Twist, self._on_command)
        subscribe(prefix + 'reset', Empty, self._on_reset)

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
        if self._static_tf and self._origin != origin:
            self._origin = origin
            self._static_tf.send(
                to_transform(origin, 'world', self._sensors.frames['odom'], now))
        for burst in bursts:
            self._sensors.send(burst, epoch)
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
        rospy.loginfo('reset: calibrating the gyro, then zeroing the odometry')


class Pacemaker:
    """Steps robots: in real time, or `speed` times as fast with a /clock that it publishes.

    That /clock runs in real time until a node listens to it, so that no node waits for a clock or
    misses the start.
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
