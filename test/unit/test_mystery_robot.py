"""The embedded robot with a hidden fault, without a master: its samples, and no truth."""
import pytest

pytest.importorskip('rospy')

from tb3_labs.robot.samples import OdometrySample    # noqa: E402
from tb3_labs.simulation import ros_robot    # noqa: E402
from tb3_labs.simulation.mystery import HiddenFault    # noqa: E402
from tb3_labs.simulation.simulator_config import SimulatorConfig    # noqa: E402


class Sensors:
    """Stands in for SensorTopics."""

    frames = {'odom': 'odom'}

    def __init__(self, prefix):
        self.samples = []

    def note_wheels(self, robot):
        pass

    def send(self, burst, epoch):
        self.samples += burst


def test_its_fault_comes_and_goes_and_no_truth_is_said(monkeypatch):
    published = []
    monkeypatch.setattr(ros_robot, 'SensorTopics', Sensors)
    monkeypatch.setattr(ros_robot, 'publisher', lambda *words: published.append(words))
    monkeypatch.setattr(ros_robot, 'subscribe', lambda *words: None)
    plain = SimulatorConfig(imu_rate=20.0)
    robot = ros_robot.FakeRobot(plain, hidden=HiddenFault(5, plain))   # silent odometry, 4.0 s
    for step in range(17 * 200):
        robot.tick(step, 0.0)
    stamps = [sample.stamp for sample in robot._sensors.samples
              if isinstance(sample, OdometrySample)]
    (silence,) = [(a, b) for a, b in zip(stamps, stamps[1:]) if b - a > 0.1]
    assert silence == pytest.approx((12.0, 16.0), abs=0.05)
    assert published == []
