"""After a pause of the computer real time is made up for, and a clock of the robot's own is not: all that
comes at once finds the nodes' sensors silent."""
import threading

import pytest

from tb3_labs.simulation import ros_robot

#: Times of a computer that pauses after a second [s].
PAUSE_AT, PAUSE = 1.0, 0.4
END = 2.0


class Computer:
    """Stands in for the module time; the robot's steps cost it no time."""

    def __init__(self):
        self.now = 0.0

    def monotonic(self):
        return self.now

    def sleep(self, seconds):
        self.now += seconds


class Robot:
    """Keeps the computer's time of each step; the computer pauses within one of them."""

    is_heard = True

    def __init__(self, computer, ending):
        self._computer, self._ending = computer, ending
        self.steps = []

    def tick(self, step, epoch):
        if self.steps and self.steps[-1] < PAUSE_AT <= self._computer.now:
            self._computer.now += PAUSE
        self.steps.append(self._computer.now)
        if self._computer.now > END:
            self._ending.set()


@pytest.mark.parametrize('clock, speed, made_up', [
    (None, 1.0, PAUSE), ('a clock', 1.0, 0.0), ('a clock', 5.0, 0.0)])
def test_a_pause(clock, speed, made_up, monkeypatch):
    computer, ending = Computer(), threading.Event()
    monkeypatch.setattr(ros_robot, 'time', computer)
    monkeypatch.setattr(ros_robot, 'publish_now', lambda clock, message: None)
    robot = Robot(computer, ending)
    pace = ros_robot.Pacemaker.__new__(ros_robot.Pacemaker)
    pace._robots, pace._epoch, pace._ending = [robot], 1e9, ending
    pace._take(clock, speed)
    pace._run()
    at_once = max(robot.steps.count(now) for now in robot.steps)
    assert at_once * ros_robot.STEP == pytest.approx(made_up, abs=3.0 * ros_robot.STEP)
    # it goes on at its own pace
    assert (len(robot.steps) - at_once) * ros_robot.STEP == pytest.approx(
        speed * (END - PAUSE), rel=0.03)
