"""Gyro against wheels: healthy robots in many motions, and robots with a wrong gyro."""
import itertools
import math
import random
from dataclasses import replace

import pytest

from real_recordings import NAMES, arrays_of
from rollout import obey
from tb3_labs.control.drive_law import DriveConfig, DriveLaw
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.localization.gyro_check import GyroMonitor
from tb3_labs.localization.odometry_jumps import EncoderMonitor
from tb3_labs.nodes.controller.core import ControllerCore
from tb3_labs.nodes.controller.turns import TurnConfig, make_turn_law
from tb3_labs.nodes.move_to_goal.core import MoveToGoalCore
from tb3_labs.robot.samples import ImuSample, OdometrySample, WheelSample
from tb3_labs.robot.turtlebot3 import robot_model
from tb3_labs.simulation.network import NETWORKS
from tb3_labs.simulation.simulator import Simulator
from tb3_labs.simulation.simulator_config import HOSTS, SimulatorConfig
from timed_part import TimedPart

BURGER = robot_model('burger')
#: (forward speed, rate of turn, seconds): rest, spins, curves, full speed, and all of it at once.
MOTIONS = [(0.0, 0.0, 1.0), (0.0, 1.5, 1.5), (0.0, -2.6, 1.0), (0.2, 0.0, 1.5), (0.2, 0.8, 1.0),
           (-0.2, -0.8, 1.0), (0.0, 0.1, 1.0), (0.0, 0.0, 0.6), (0.05, 2.0, 1.0), (0.0, 0.0, 1.0)]
SLOW = {'yaw_lag': 0.105, 'wheel_lag': 0.02}


class Watched:
    """A robot and the core that receives its samples, by default a GyroMonitor. The samples of the wheels arrive with
    the odometry, as the robot's node sends them."""

    def __init__(self, core=None, **settings):
        self.robot = Simulator(SimulatorConfig(**settings))
        self.core = core or TimedPart(GyroMonitor(robot_model(self.robot.config.model)))
        self.encoders = EncoderMonitor()
        self._wheels = {}            # by stamp
        self.clock_ahead = 0.0       # of the robot [s]
        self.log_lines = []          # of a core that drives

    def set(self, **settings):
        self.clock_ahead = settings.pop('clock_ahead', self.clock_ahead)
        self.robot.configure(replace(self.robot.config, **settings))

    def problem_text(self):
        return self.core.problem_text()

    def run(self, seconds, linear=0.0, angular=0.0, until=lambda: False):
        """Let time pass, with commands at 20 Hz, or with the commands of a core that drives."""
        end = self.robot.now + seconds
        for tick in itertools.count():
            if self.robot.now >= end or until():
                return
            drives = hasattr(self.core, 'tick')
            if tick % 10 == 0 and not drives:
                self.robot.command(linear, angular)
            samples = self.robot.step(0.005)
            sensors = self.robot.sensors
            self._wheels.update(wheels[:2] for wheels in list(sensors.wheel_readings)[-1:])
            for sample in samples:
                self._hear(sample)
            if drives:
                obey(self.robot, self.core, self.log_lines)

    def _hear(self, sample):
        if not isinstance(sample, ImuSample):
            self.encoders.on_odometry(sample)
            self.encoders.on_wheels(WheelSample(sample.stamp, *self._wheels[sample.stamp]))
            assert self.robot.config.battery_cut or self.encoders.problem_text() == ''
        stamp = sample.stamp + self.clock_ahead
        if isinstance(sample, ImuSample):
            self.core.on_imu(sample._replace(stamp=stamp), self.robot.now)
            return
        self.core.on_wheels(WheelSample(stamp, *self._wheels[sample.stamp]))
        if isinstance(self.core, MoveToGoalCore):
            self.core.on_odometry(sample, self.robot.now)


def navigator():
    return MoveToGoalCore(DriveLaw(DriveConfig(), BURGER), has_control=True)


def controller():
    return ControllerCore(make_turn_law(TurnConfig(), BURGER))


@pytest.mark.parametrize('settings', [
    {}, {'slip': 0.05, 'wheel_mismatch': 0.03}, {'slip': 0.05, 'wheel_mismatch': -0.03},
    {'motor_lag': 0.5}, {'imu_rate': 20.0, 'odom_rate': 20.0},
    {'imu_noise_deg': 1.0, 'gyro_noise': 0.02, 'imu_offset_deg': 180.0},
    {'imu_drift_deg_per_min': 60.0}, {'model': 'waffle'}, {'yaw_lag': 0.0, 'wheel_lag': 0.03},
    dict(SLOW, slip=0.05), {'slip': 1.0},
    dict(HOSTS['pi'], **NETWORKS['bad']), HOSTS['laptop'],
    {'slip': 0.4}, {'slip': 0.2}, {'wheel_mismatch': 0.08}, {'wheel_mismatch': -0.08}], ids=str)
def test_a_healthy_gyro_never_contradicts_the_wheels(settings):
    watched = Watched(**settings)
    for linear, angular, seconds in MOTIONS:
        watched.run(seconds, linear, angular, until=watched.problem_text)
        assert watched.problem_text() == '', (linear, angular)


class Losing(Watched):
    """A busy computer: the newest sample replaces those that were not read in time."""

    def __init__(self, **settings):
        super().__init__(**settings)
        self._random = random.Random(1)
        self._deaf_until = {ImuSample: 0.0, OdometrySample: 0.0}

    def _hear(self, sample):
        if self.robot.now < self._deaf_until[type(sample)]:
            return
        if self._random.random() < 0.1:
            longest = 0.14 if isinstance(sample, ImuSample) else 0.28
            self._deaf_until[type(sample)] = self.robot.now + self._random.uniform(0.0, longest)
        super()._hear(sample)


@pytest.mark.parametrize('settings', [{'slip': 0.05}, HOSTS['pi']], ids=str)
def test_lost_samples_cause_no_false_alarm(settings):
    watched = Losing(**settings)
    for linear, angular, seconds in 2 * MOTIONS:
        watched.run(seconds, linear, angular, until=watched.problem_text)
        assert watched.problem_text() == '', (linear, angular)
    watched.set(gyro_bias_deg=5.0)
    watched.run(2.0, until=watched.problem_text)
    assert watched.problem_text()


@pytest.mark.parametrize('sign', [1.0, -1.0])
@pytest.mark.parametrize('words, settings, steps', [
    *[('an error that slip may explain is found when the wheels rest', {'slip': slip}, [
        (1.5,), (0.8, 0.0, 1.5), {'gyro_bias_deg': -28.0}, (0.8, 0.0, 1.5), False, (0.6,), True])
      for slip in (0.0, 0.1)],
    *[('the floor changes in a turn', {'slip': slip}, [
        (1.5,), (0.7, 0.0, 1.5), {'slip': 0.4 - slip}, (0.7, 0.0, 1.5), False])
      for slip in (0.0, 0.1, 0.4)],
    ('the turn of the wheels explains an error for 0.13 s, not for WHEEL_MEMORY_TIME', {}, [
        (1.0, 0.0, 1.5), {'gyro_bias_deg': 28.0}, (0.4,), True]),
    ('a frozen IMU repeats a rate: SensorMonitor finds this fault', {}, [
        (1.0, 0.0, 1.5), {'imu_frozen': True}, (2.0,), False]),
    *[('a turn about one wheel without a rest', {'slip': 0.05, 'wheel_mismatch': mismatch}, [
        (2.0, 0.1, 1.3), False]) for mismatch in (0.05, -0.05)],
    ("the robot's clock is set", {}, [
        (1.0, 0.0, 1.5), {'clock_ahead': 7.0}, (0.5, 0.0, 1.5), False, {'gyro_bias_deg': 28.0},
        (0.5, 0.0, 1.5), True]),
    ('a contradiction lasts until gyro and wheels agreed for a second at rest', {}, [
        {'gyro_bias_deg': 10.0}, (1.0,), {'gyro_bias_deg': 2.0}, (2.0, 0.2),
        {'gyro_bias_deg': 0.0}, (0.5,), True, (1.8,), False])])
def test_a_gyro_in_a_sequence_of_motions(words, settings, steps, sign):
    """A step is a command (seconds, forward speed, rate of turn), a change of settings, or the expected verdict."""
    watched = Watched(**settings)
    for step in steps:
        if isinstance(step, tuple):
            seconds, linear, angular = step + (0.0, 0.0)[len(step) - 1:]
            watched.run(seconds, linear, sign * angular)
        elif isinstance(step, dict):
            watched.set(**{name: sign * value if name in ('gyro_bias_deg', 'clock_ahead') else value
                           for name, value in step.items()})
        else:
            assert bool(watched.problem_text()) is step, words
    assert watched.core.has_compared


@pytest.mark.parametrize('bias_deg, found_in', [(0.0, math.inf), (3.0, 2.0), (-28.0, 0.5)])
@pytest.mark.parametrize('name', NAMES)
def test_a_recorded_gyro_contradicts_the_wheels_only_with_a_bias(name, bias_deg, found_in):
    watch = TimedPart(GyroMonitor(BURGER))
    imu, wheels = arrays_of(name, ('imu', 'wheels'))
    heard = sorted(
        [(arrival, watch.on_imu, ImuSample(stamp, yaw, rate + math.radians(bias_deg)))
         for arrival, stamp, yaw, rate in imu.tolist()]
        + [(row[0], lambda wheels, _: watch.on_wheels(wheels), WheelSample(*row[1:])) for row in wheels.tolist()],
        key=lambda entry: entry[0])
    accused_at = math.inf
    for arrival, hear, sample in heard:
        hear(sample, arrival)
        if watch.problem_text():
            accused_at = min(accused_at, arrival - heard[0][0])
    assert accused_at <= found_in and (accused_at < math.inf) is bool(bias_deg)


@pytest.mark.parametrize('speeds, bias_deg', [
    ((0.0, 0.0), 12.0), ((0.0, 0.0), -12.0), ((0.2, 0.0), 12.0), ((0.2, 0.0), -12.0),
    ((0.0, -1.5), -20.0), ((0.15, 0.8), 20.0)])
@pytest.mark.parametrize('settings', [{}, SLOW], ids=str)
def test_a_wrong_gyro_is_found_before_5_degrees(speeds, bias_deg, settings):
    watched = Watched(TimedPart(GyroMonitor(BURGER, '/robot3/reset')), **settings)
    watched.run(2.0, *speeds)
    begun = watched.robot.now
    watched.set(gyro_bias_deg=bias_deg)
    watched.run(3.0, *speeds, until=watched.problem_text)
    assert abs(bias_deg) * (watched.robot.now - begun) < 5.0
    assert 'rostopic pub -1 /robot3/reset' in watched.problem_text()


@pytest.mark.parametrize('settings, begins', [
    ({'gyro_noise': 0.05, 'imu_noise_deg': 1.0}, True), (SLOW, True),
    ({'gyro_bias_deg': 5.0}, False), ({'gyro_bias_deg': -86.0}, False)], ids=str)
@pytest.mark.parametrize('make', [navigator, controller])
def test_a_motion_waits_until_gyro_and_wheels_were_compared_at_rest(make, settings, begins):
    """Control and goal were given before the robot's board was connected."""
    core = make()
    watched = Watched(core, **settings)
    if make is navigator:
        core.set_goal(Pose2(1.0, 1.0, 0.0))
    else:
        watched.run(0.05)
        core.request_turn(90.0, watched.robot.now)
    watched.run(3.0, until=lambda: watched.robot.truth != Pose2())
    assert (1.1 < watched.robot.now < 1.6) is (watched.robot.truth != Pose2()) is begins
    status = core.status(watched.robot.now) if make is navigator else None
    problem = status.sensor_problem if status else core.problem_text(watched.robot.now)
    assert ('the gyro contradicts the wheels' in problem) is not begins
    if status:
        assert problem in status.text
    elif not begins:
        with pytest.raises(ValueError, match='cannot turn: the gyro contradicts the wheels'):
            core.request_turn(90.0, watched.robot.now)


class StuckOrientation(Watched):
    """The orientation of the IMU never changes, as in turtlebot3 #912. The gyro works."""

    def _hear(self, sample):
        super()._hear(sample._replace(yaw=0.3) if isinstance(sample, ImuSample) else sample)


@pytest.mark.parametrize('make', [navigator, controller])
def test_an_orientation_that_never_changes_ends_the_motion(make):
    core = make()
    watched = StuckOrientation(core)
    if make is navigator:
        core.set_goal(Pose2(0.0, 1.0, 0.0))
    watched.run(1.5)
    if make is controller:
        core.request_turn(90.0, watched.robot.now)
    watched.run(3.0)
    assert 'imu repeats one reading' in watched.log_lines[-1].text
    assert 0.0 < watched.robot.truth.yaw < math.radians(64.0)


@pytest.mark.parametrize('sends', ['nothing', 'no stamps', 'rarely', 'other joints'])
def test_a_motion_waits_one_second_for_wheels_that_cannot_be_compared(sends):
    watch = TimedPart(GyroMonitor(BURGER))
    for k in range(1, 400):
        now = 10.0 + 0.01 * k
        stamp = 0.0 if sends == 'no stamps' else now
        watch.on_imu(ImuSample(stamp, math.remainder(0.02 * k, math.tau), 2.0), now, sends != 'nothing')
        if sends == 'no stamps' and k % 3 == 0 or sends == 'rarely' and k % 50 == 0:
            watch.on_wheels(WheelSample(stamp, 0.0, 0.0))
        if sends == 'nothing' or k > 105:
            assert not watch.needs_comparison
        elif k < 90:
            assert watch.needs_comparison
    assert not watch.has_compared and watch.problem_text() == ''
    watch.on_imu(ImuSample(stamp + 2.1, 0.0, 0.0), now + 2.1)     # the board may be new
    assert watch.needs_comparison is (sends != 'nothing')


def contradicts(rate, shown):
    """Does a gyro that shows the rate `shown` contradict wheels that turn the robot on the spot at `rate` [rad/s]? The
    samples have no noise and no lag."""
    watch, yaw, wheel = TimedPart(GyroMonitor(BURGER)), 0.0, 0.0
    for tick in range(300):
        now = 50.0 + 0.01 * tick
        if tick % 3 == 0:
            watch.on_wheels(WheelSample(now, -wheel, wheel))
        watch.on_imu(ImuSample(now, yaw, shown), now)
        yaw += 0.01 * shown
        wheel += 0.01 * rate * BURGER.wheel_separation / BURGER.wheel_radius / 2.0
    return bool(watch.problem_text())


@pytest.mark.parametrize('sign', [1.0, -1.0])
@pytest.mark.parametrize('rate', [0.2, 1.0, 2.0])
def test_the_bounds_of_a_healthy_gyro_in_closed_form(rate, sign):
    """Slip is 0 to 45 %, drift 0.02 rad/s. Uneven wheels are 10 % of the rate of one wheel, which is half the rate."""
    margin = 0.02 + 0.1 * rate / 2.0
    least, most = 0.55 * rate - margin, rate + margin
    assert [contradicts(sign * rate, sign * shown)
            for shown in (least - 0.03, least + 0.005, most - 0.005, most + 0.03)] == [True, False, False, True]
