"""A simulated robot on the topics of a real one, and its time: real, or its own on /clock."""
import itertools
import os
import threading
import time
from contextlib import suppress

import rospy
from geometry_msgs.msg import PoseStamped, Twist
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Empty
from tf2_msgs.msg import TFMessage

from tb3_labs.ros.conversions import TRUTH_PIPE, to_pose_stamped, to_transform
from tb3_labs.ros.node import guarded
from tb3_labs.simulation.ros_sensors import SensorTopics, publisher
from tb3_labs.simulation.simulator import Simulator

SIMULATION_STEP = 1.0 / 200.0     # of the simulation [s]
TRUTH_EVERY = 4        # steps between two messages of the ground truth
#: If the computer pauses for up to this time, the robot catches up [s].
CATCH_UP = 0.5
#: If the robot publishes /clock, it catches up after a pause of up to this time [s, wall clock]. On
#: /clock the pause is `speed` times as long, and passes at once: after a longer one a node would
#: find its sensors silent.
CATCH_UP_CLOCK = 0.02


class FakeRobot:
    """One Simulator and its topics.

    A robot with a `hidden` fault (mystery_robot.HiddenFault) takes its settings from there. It has
    no /tf_static and no ground truth, since both would show the fault. If the environment names a
    TRUTH_PIPE, the truth goes there, and there is no ground truth on a topic.
    """

    def __init__(self, settings, hidden=None):
        self._lock = threading.Lock()    # guards the simulator
        self._hidden = hidden
        self._robot = Simulator(hidden.settings_at(0.0) if hidden else settings)
        self._sensors = SensorTopics()
        pipe = os.environ.get(TRUTH_PIPE)
        self._pipe = TruthPipe(pipe) if pipe else None
        self._truth = None if hidden or pipe else publisher('ground_truth', PoseStamped)
        self._static_tf = None if hidden else publisher('/tf_static', TFMessage, latch=True)
        self._origin = None
        for topic, kind, callback in (('cmd_vel', Twist, self._on_command),
                                      ('reset', Empty, self._on_reset),
                                      ('sound', rospy.AnyMsg, self._on_sound)):
            rospy.Subscriber(topic, kind, guarded(callback), queue_size=1, tcp_nodelay=True)

    def configure(self, settings):
        """Use other settings from now on, except those of the start."""
        with self._lock:
            self._robot.configure(settings)

    @property
    def is_heard(self):
        """Does any node listen to its sensors?"""
        return self._sensors.are_heard

    def tick(self, step, epoch):
        """Let one SIMULATION_STEP pass, and send what is due; `epoch`: the robot's time 0 [s]."""
        truth_is_due = step % TRUTH_EVERY == 0 and (
            self._pipe.is_heard() if self._pipe else self._truth and self._truth.get_num_connections())
        with self._lock:
            self._use_hidden_settings()
            bursts = self._robot.step_in_bursts(SIMULATION_STEP)
            now = epoch + self._robot.now
            origin = self._robot.sensors.origin
            truth = self._robot.truth if truth_is_due else None
            self._sensors.note_wheels(self._robot.sensors)
        if self._static_tf and self._origin != origin:
            self._origin = origin
            self._static_tf.publish(TFMessage([
                to_transform(origin, 'world', self._sensors.frames['odom'], now)]))
        for burst in bursts:
            self._sensors.send(burst, epoch)
        if truth is not None and self._pipe:
            self._pipe.write(truth)
        elif truth is not None:
            self._truth.publish(to_pose_stamped(truth, 'world', now))

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

    def _on_sound(self, message):
        with self._lock:
            self._robot.sound(message._buff[0])


class Pacemaker:
    """Steps a robot: in real time, or `speed` times as fast with a /clock that it publishes.

    The /clock runs in real time until a node listens to the robot, so that a node does not wait for
    a clock, and does not miss the start.
    """

    def __init__(self, robot, speed):
        self._robot = robot
        self._epoch = time.time()  # the robot's time 0, also with its own /clock
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
                now = self._epoch + (step + 1) * SIMULATION_STEP
                self._clock.publish(Clock(rospy.Time.from_sec(now)))
            self._robot.tick(step, self._epoch)
            if speed != self._speed and self._robot.is_heard:
                speed = self._speed
            due += SIMULATION_STEP / speed
            late = time.monotonic() - due
            if late < 0.0:
                time.sleep(-late)
            elif late > (CATCH_UP_CLOCK if self._clock else CATCH_UP):
                due += late
                self._epoch += 0.0 if self._clock else late


class TruthPipe:
    """Writes true poses into a named pipe, which its reader makes."""

    def __init__(self, path):
        self._path, self._pipe = path, -1

    def is_heard(self):
        """Does anybody read? While nobody does, this looks for the pipe anew."""
        if self._pipe < 0:
            with suppress(OSError):     # there is no reader yet
                self._pipe = os.open(self._path, os.O_WRONLY | os.O_NONBLOCK)
        return self._pipe >= 0

    def write(self, pose):
        """Write a pose, or drop it: the robot never waits for a reader."""
        with suppress(OSError):
            os.write(self._pipe, '{:.9g} {:.9g} {:.9g}\n'.format(pose.x, pose.y, pose.yaw).encode())
