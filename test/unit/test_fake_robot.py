"""The pace of the simulated robot's time, without a master."""
from types import SimpleNamespace

import pytest

from tb3_labs.simulation import ros_fake_robot

#: Times of a computer that pauses after a second [s].
PAUSE_AT, PAUSE = 1.0, 0.4
END = 2.0
#: Takes the place of the publisher of /clock.
SILENT = SimpleNamespace(publish=lambda message: None)


class Computer:
    """Takes the place of the module `time`. The steps of the robot take no time."""

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
    """The robot catches up with real time, but not with its own clock. Otherwise nodes would see silent sensors, and
    then all samples at once."""
    computer = Computer()
    monkeypatch.setattr(ros_fake_robot, 'time', computer)
    robot = TimedRobot(computer)
    with pytest.raises(EOFError):
        ros_fake_robot.keep_pace(robot, clock, speed)
    step = ros_fake_robot.SIMULATION_STEP
    at_once = max(robot.steps.count(now) for now in robot.steps)
    assert at_once * step == pytest.approx(made_up, abs=3.0 * step)
    # it goes on at its own pace
    assert (len(robot.steps) - at_once) * step == pytest.approx(speed * (END - PAUSE), rel=0.03)
