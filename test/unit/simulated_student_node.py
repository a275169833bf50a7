"""Runs the text of a node of the Transformation lab with a stub of rospy, beside a robot that moves as commanded. The
node gets the same drives and resets as in the check."""
import math
import sys
import types
from functools import lru_cache
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np

from tb3_labs.recording.run_data import (
    Commands, ImuSamples, Numbers, OdometrySamples, Poses, RunData, Variables)

PLAIN = Path(__file__).resolve().parents[2] / 'scripts' / 'plain_move2goal_tf.py'
HZ = 50


def turned(yaw):
    """Returns the quaternion of a yaw [rad]."""
    return SimpleNamespace(w=math.cos(yaw / 2.0), x=0.0, y=0.0, z=math.sin(yaw / 2.0))


def posed(x, y, yaw):
    """Returns an odometry message with a pose. The request of a reset has a pose of this kind, too."""
    return SimpleNamespace(pose=SimpleNamespace(pose=SimpleNamespace(
        position=SimpleNamespace(x=x, y=y), orientation=turned(yaw))))


def unchangeable(column):
    """Returns a column as an array that no test can change, since several tests share it."""
    array = np.array(column, dtype=object if isinstance(column[0], str) else None)
    array.setflags(write=False)
    return array


class SimulatedNode:
    """A node and its robot. `offset` [rad] is the IMU's yaw minus the odometry's yaw."""

    def __init__(self, text, pose=(0.0, 0.0, 0.0), offset=0.3):
        self.pose, self.offset, self.command, self.step = pose, offset, (0.0, 0.0), 0
        self.heard, self.services, self.timers, self.problem = {}, [], [], None
        self.rows = {kind: [] for kind in (
            ImuSamples, OdometrySamples, Commands, Numbers, Poses, Variables)}
        rospy = types.ModuleType('rospy')
        vars(rospy).update(
            Duration=float, loginfo=lambda *_: None,
            Publisher=lambda topic, *_, **__: SimpleNamespace(publish=self.publish),
            Subscriber=lambda topic, _, callback: self.heard.update({topic: callback}),
            Service=lambda *values: self.services.append(values[-1]),
            Timer=lambda *values: self.timers.append(values))
        names = {'__name__': 'node'}
        with patch.dict(sys.modules, rospy=rospy):
            exec(compile(text, 'node', 'exec'), names)
        self.node = names['MoveToGoal']()

    def note(self, kind, *values):
        self.rows[kind].append((self.step / HZ, self.step / HZ, *values))

    def publish(self, twist):
        self.command = twist.linear.x, twist.angular.z
        self.note(Commands, *self.command, *4 * [0.0], '')

    def call(self, function, *values):
        try:
            function(*values)
        except AttributeError as error:
            self.problem = error

    def say(self, topic, message):
        if topic in self.heard:
            self.call(self.heard[topic], message)

    def give(self, given):
        self.note(Numbers, float(given))
        self.say('ctrl_relinq', SimpleNamespace(data=given))

    def reset(self, *pose):
        self.note(Poses, *pose)
        for each in self.services:
            self.call(each, SimpleNamespace(pose=posed(*pose)))

    def run(self, seconds, turn=None):
        """Let time pass. If `turn` is given, the robot is turned by hand at this rate [rad/s]."""
        for _ in range(round(seconds * HZ)):
            self.step += 1
            linear, angular = self.command if turn is None else (0.0, turn)
            (x, y, yaw), linear = self.pose, min(0.22, max(-0.22, linear))
            self.pose = (x + linear * math.cos(yaw) / HZ, y + linear * math.sin(yaw) / HZ,
                         math.remainder(yaw + angular / HZ, math.tau))
            q = turned(math.remainder(self.pose[2] + self.offset, math.tau))
            self.note(ImuSamples, 2.0 * math.atan2(q.z, q.w), 0.0, q.w, q.x, q.y, q.z)
            self.say('imu', SimpleNamespace(orientation=q))
            if self.step % 2 == 0:
                self.note(OdometrySamples, *self.pose, 0.0, 0.0)
                self.say('odom', posed(*self.pose))
            for period, function in self.timers:
                if self.step % round(period * HZ) == 0:
                    self.call(function, None)
            if self.step % 3 == 1:
                for name, value in vars(self.node).items():
                    if isinstance(value, (bool, int, float, str, type(None))):
                        self.note(Variables, '/move_to_goal', name, str(value))

    def drive(self):
        """Give control until no command has moved the robot for 1.5 s."""
        self.give(True)
        begin = last = self.step
        while self.step - begin < 40 * HZ and (
                self.step - begin < 4 * HZ or self.step - last < 1.5 * HZ):
            self.run(0.1)
            last = self.step if any(self.command) else last
        self.run(1.5)
        self.give(False)
        self.run(0.5)

    def data(self):
        columns = {kind: kind(*map(unchangeable, zip(*rows))) if rows else kind.none()
                   for kind, rows in self.rows.items()}
        return RunData('node', 0.0, self.step / HZ, columns[ImuSamples], columns[OdometrySamples],
                       columns[Commands], goals=Poses(*np.array([[0.0], [0.0], [-0.61], [0.61], [0.0]])),
                       resets=columns[Poses], control=columns[Numbers], starts=(0.0,),
                       variables=columns[Variables])


@lru_cache(maxsize=None)
def played(*changes, **robot):
    """The RunData of the plain node with these changes of its text, each (old, new). Its arrays cannot be changed."""
    text = PLAIN.read_text(encoding='utf-8')
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    trial = SimulatedNode(text, **robot)
    trial.give(False)
    trial.run(1.5)
    trial.drive()
    trial.run(1.75, 1.0)
    trial.reset(0.0, 0.0, 0.0)
    trial.run(0.5)
    trial.drive()
    trial.reset(0.0, 0.0, 0.0)
    trial.run(0.5)
    trial.run(2.356, 1.0)
    trial.give(True)
    trial.run(1.0)
    trial.reset(0.0, 0.0, 0.0)      # in the middle of a drive
    trial.run(3.0)
    trial.give(False)
    trial.run(0.5)
    trial.reset(0.2, 0.3, math.pi / 2.0)
    trial.run(0.5)
    trial.drive()
    return trial.data()
