"""The simulated robot on its topics, without a master: a hidden fault, and the pace of their time."""
from types import SimpleNamespace

import pytest

from tb3_labs.robot.samples import OdometrySample
from tb3_labs.simulation import ros_fake_robot
from tb3_labs.simulation.mystery_robot import HiddenFault
from tb3_labs.simulation.simulator_config import SimulatorConfig

#: Times of a computer that pauses after a second [s].
PAUSE_AT, PAUSE = 1.0, 0.4
END = 2.0
#: Stands in for the publisher of a /clock.
SILENT = SimpleNamespace(publish=lambda message: None)


class FakeSensorTopics:
    """Stands in for SensorTopics."""

    frames = {'odom': 'odom'}

    def __init__(self):
        self.samples = []

    def send(self, burst, epoch, wheels):
        self.samples += burst


def test_its_fault_comes_and_goes_and_no_truth_is_said(monkeypatch):
    published = []
    monkeypatch.setattr(ros_fake_robot, 'SensorTopics', FakeSensorTopics)
    monkeypatch.setattr(ros_fake_robot, 'publisher', lambda *words, **_: published.append(words))
    monkeypatch.setattr(ros_fake_robot.rospy, 'Subscriber', lambda *words, **_: None)
    plain = SimulatorConfig(imu_rate=20.0)
    robot = ros_fake_robot.FakeRobot(plain, hidden=HiddenFault(5, plain))   # silent odometry, 4.0 s
    for step in range(17 * 200):
        robot.tick(step, 0.0)
    stamps = [sample.stamp for sample in robot._sensors.samples
              if isinstance(sample, OdometrySample)]
    (silence,) = [(a, b) for a, b in zip(stamps, stamps[1:]) if b - a > 0.1]
    assert silence == pytest.approx((12.0, 16.0), abs=0.05)
    assert published == []


class Computer:
    """Stands in for the module time; the robot's steps cost it no time."""

    def __init__(self):
        self.now = 0.0

    def monotonic(self):
        return self.now

    time = monotonic

    def sleep(self, seconds):
        self.now += seconds


class TimedRobot:
    """Keeps the computer's time of each step; the computer pauses in one step."""

    def __init__(self, computer):
        self._computer, self.steps = computer, []

    def tick(self, step, epoch):
        if self.steps and self.steps[-1] < PAUSE_AT <= self._computer.now:
            self._computer.now += PAUSE
        self.steps.append(self._computer.now)
        if self._computer.now > END:
            raise EOFError


@pytest.mark.parametrize('clock, speed, made_up', [
    (None, 1.0, PAUSE), (SILENT, 1.0, 0.0), (SILENT, 5.0, 0.0)])
def test_a_pause(clock, speed, made_up, monkeypatch):
    """The robot catches up with real time, but not with its own clock: nodes would see their sensors silent, then all
    samples at once."""
    computer = Computer()
    monkeypatch.setattr(ros_fake_robot, 'time', computer)
    robot = TimedRobot(computer)
    with pytest.raises(EOFError):
        ros_fake_robot.keep_pace(robot, clock, speed)
    at_once = max(robot.steps.count(now) for now in robot.steps)
    assert at_once * ros_fake_robot.SIMULATION_STEP == pytest.approx(made_up, abs=3.0 * ros_fake_robot.SIMULATION_STEP)
    # it goes on at its own pace
    assert (len(robot.steps) - at_once) * ros_fake_robot.SIMULATION_STEP == pytest.approx(
        speed * (END - PAUSE), rel=0.03)
