"""The simulated robot does what the robot's own firmware did: the same commands, the same figures.

The figures come from eight recordings of turtlebot3_core 1.2.6 on a simulated body, behind a
fast computer and behind a slow one. Times start a moment before the first command. A command
waits up to 33 ms for the board's tick, in the recording and here: 7 mm, or 2 deg.
"""
import math

import numpy as np
import pytest
from simulated import imu_of, odom_of

from tb3_labs.simulation.simulator import Simulator
from tb3_labs.simulation.simulator_config import HOSTS, SimulatorConfig

STEP = 0.01
TICK_WAY, TICK_TURN = 0.007, 2.0        # [m], [deg]
LAPTOP = SimulatorConfig(**HOSTS['laptop'])
#: (from, to, forward speed, rate of turn) of commands at 30 Hz.
DRIVE = [(0.820, 2.391, 0.0, 1.0), (2.391, 2.891, 0.0, 0.0), (2.891, 5.391, 0.2, 0.0),
         (5.391, 5.891, 0.0, 0.0), (5.891, 9.383, 0.0, -1.0), (9.383, 9.883, 0.0, 0.0),
         (9.883, 11.383, 0.2, 0.0), (11.383, 11.85, 0.0, 0.0)]


class Replay:
    """The commands of a recording, with a reset at some time, through the simulated robot."""

    def __init__(self, commands, seconds, reset=None, config=LAPTOP):
        robot, self.samples, truths, due = Simulator(config), [], [], 0.0
        while robot.now < seconds:
            for begin, end, linear, angular in commands:
                if begin <= robot.now < end and robot.now >= due:
                    robot.command(linear, angular)
                    due = robot.now + 1.0 / 30.0
            if reset is not None and robot.now >= reset:
                robot.reset()
                reset = None
            self.samples += robot.step(STEP)
            pose = robot.truth
            truths.append((robot.now, pose.x, pose.y, pose.yaw))
        self.robot, self.truth = robot, np.array(truths)
        self.truth[:, 3] = np.unwrap(self.truth[:, 3])
        self.imu = np.array(imu_of(self.samples))
        self.odometry = odom_of(self.samples)
        self.way = np.append(0.0, np.cumsum(np.hypot(*np.diff(self.truth[:, 1:3], axis=0).T)))

    def turned(self, begin, end):
        """True turn [deg] between two times."""
        return math.degrees(np.subtract(*np.interp([end, begin], self.truth[:, 0],
                                                   self.truth[:, 3])))

    def driven(self, begin, end):
        """True path [m] between two times."""
        return np.subtract(*np.interp([end, begin], self.truth[:, 0], self.way))

    def pause(self):
        """(row of the IMU before the longest silence, row after it)."""
        row = np.argmax(np.diff(self.imu[:, 0]))
        return self.imu[row], self.imu[row + 1]

    def odometry_after(self, stamp):
        """The first odometry at `stamp` or later."""
        return next(sample for sample in self.odometry if sample.stamp >= stamp)

    def lag(self, begin, end):
        """Returns the lag [s] of the IMU's yaw behind the true yaw, in a steady turn."""
        stamps, yaws = self.imu[:, 0], np.unwrap(self.imu[:, 1])
        turning = (begin < stamps) & (stamps < end)
        behind = np.interp(stamps[turning], self.truth[:, 0], self.truth[:, 3]) - yaws[turning]
        return np.mean(behind) / math.radians(self.turned(begin, end) / (end - begin))

    def rest(self):
        """(rate of the gyro [rad/s], drift of the IMU's yaw [deg/s]) in the last second."""
        last = self.imu[self.imu[:, 0] > self.robot.now - 1.0]
        turn = np.unwrap(last[:, 1])[[0, -1]]
        return np.mean(last[:, 2]), math.degrees((turn[1] - turn[0]) / (last[-1, 0] - last[0, 0]))


@pytest.mark.parametrize('host, imu_rate, odom_rate, lag', [
    ('laptop', 171.0, 29.85, 0.0115), ('pi', 113.0, 28.8, 0.0850)])
def test_a_drive_and_its_computer(host, imu_rate, odom_rate, lag):
    """The lags are without the error of the stamps, which was 6 and 22 ms at most."""
    replay = Replay(DRIVE, 13.0, config=SimulatorConfig(**dict(HOSTS[host], stamp_step=0.0)))
    assert replay.turned(0.0, 2.8) == pytest.approx(91.8, abs=TICK_TURN)
    assert replay.driven(2.8, 5.8) == pytest.approx(0.494, abs=TICK_WAY)
    assert replay.turned(5.8, 9.8) == pytest.approx(-200.9, abs=TICK_TURN)
    assert replay.driven(9.8, 13.0) == pytest.approx(0.2957, abs=TICK_WAY)
    assert len(replay.imu) / 13.0 == pytest.approx(imu_rate, rel=0.03)
    assert len(replay.odometry) / 13.0 == pytest.approx(odom_rate, rel=0.01)
    assert replay.lag(1.3, 2.3) == pytest.approx(lag, abs=0.005)
    assert replay.lag(6.3, 9.3) == pytest.approx(lag, abs=0.005)


def test_a_reset_in_a_drive():
    """Zero commands arrive 0.2 s after the reset. The board obeys them when the pause is over."""
    replay = Replay([(0.492, 2.699, 0.2, 0.0), (2.699, 3.67, 0.0, 0.0)], 9.0, reset=2.498)
    before, after = replay.pause()
    assert after[0] - before[0] == pytest.approx(2.58, abs=0.1)
    assert replay.driven(before[0], after[0]) == pytest.approx(0.514, abs=0.015)
    assert replay.driven(0.0, 9.0) == pytest.approx(0.9056, abs=2.0 * TICK_WAY)
    assert math.degrees(after[1] - before[1]) == pytest.approx(1.83, abs=0.1)
    odometry = replay.odometry_after(after[0])
    assert (odometry.pose.x, odometry.pose.y) == pytest.approx((0.0, 0.0), abs=1e-6)
    assert math.degrees(odometry.pose.yaw) == pytest.approx(1.83, abs=0.1)
    assert replay.odometry[-1].pose.x == pytest.approx(0.0097, abs=0.004)
    assert replay.rest() == pytest.approx((0.0, 0.0), abs=0.02)


def test_a_gyro_that_was_calibrated_in_motion():
    commands = [(0.423, 1.9, 0.0, 0.5), (10.222, 13.222, 0.15, 0.0), (13.222, 13.69, 0.0, 0.0)]
    replay = Replay(commands, 15.2, reset=1.923)
    assert replay.turned(0.0, 10.0) == pytest.approx(114.7, abs=TICK_TURN)
    assert replay.driven(10.0, 15.2) == pytest.approx(0.446, abs=TICK_WAY)
    assert replay.rest() == pytest.approx((-0.494, -28.31), rel=0.02)
    odometry = replay.odometry[-1].pose
    assert (odometry.x, odometry.y) == pytest.approx((-0.264, -0.310), abs=0.03)
