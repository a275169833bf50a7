"""The guided test drive: its numbers are true within their errors, its faults named, and it always stops.

test/benchmark/commission.py does the same with hundreds of random robots.
"""
import math
import os
import pathlib
import sys
from dataclasses import replace
from functools import lru_cache
from itertools import groupby

import numpy as np
import pytest
import rosbag
import yaml

from tb3_labs.commissioning import findings, page, ride, steps
from tb3_labs.commissioning.estimates import estimates, pooled
from tb3_labs.commissioning.findings import FAULT, LOOK, OK
from tb3_labs.commissioning.recording import Mark, Recording
from tb3_labs.commissioning.responses import fit, travel
from tb3_labs.commissioning.ride import Phase, Ride
from tb3_labs.commissioning.ros_commission import Terminal
from tb3_labs.commissioning.sensors import Estimate
from tb3_labs.commissioning.twin import Playground, driven
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.samples import ImuSample, OdometrySample
from tb3_labs.robot.turtlebot3 import robot_model
from tb3_labs.ros.conversions import to_imu_sample, to_odometry_sample
from tb3_labs.simulation.simulator_config import HOSTS, SimulatorConfig

BURGER = robot_model('burger')
PLAIN = SimulatorConfig(
    imu_offset_deg=140.0, imu_drift_deg_per_min=1.5, motor_lag=0.09, wheel_separation=0.164, wheel_radius=0.0325,
    wheel_mismatch=0.008, command_latency=0.02, sensor_latency=0.02, reset_pause=2.6, **HOSTS['pi'])


@pytest.fixture(scope='module')
def recording():
    return driven(PLAIN)


@pytest.fixture(scope='module')
def found(recording):
    return estimates(recording, BURGER)


@pytest.mark.parametrize('name, true', [
    ('imu_rate', 115.0), ('odom_rate', 28.8), ('imu_offset_deg', 140.0), ('imu_drift_deg_per_min', 1.5),
    ('motor_lag', 0.09), ('turn_lag', 0.09), ('drive_lag', 0.09), ('wheel_separation', 0.164),
    ('wheel_radius', 0.0325 * 0.996), ('wheel_mismatch', 0.008), ('sensor_latency', 0.02), ('sensor_jitter', 0.0),
    ('stamp_step', 0.02), ('reset_pause', 2.6), ('time_out', 0.5), ('gyro_scale', 1.0),
    ('turn_delay', 0.02 + 0.02 + 0.5 / 30.0 + 0.085), ('drive_delay', 0.02 + 0.02 + 0.5 / 30.0 + 0.075),
    ('top_speed', 265 * 0.229 * 2.0 * math.pi / 60.0 * 0.033)])
def test_a_number_is_true_within_its_error(found, name, true):
    value, error = found[name]
    assert abs(value - true) <= error < max(0.3 * abs(true), 0.02)


def test_a_healthy_robot_is_not_accused(recording, found):
    lines = findings.findings(recording, found, BURGER)
    assert len(lines) > 20 and not recording.ended
    assert [line for line in lines if line.verdict == FAULT] == []


def test_the_simulated_robot_becomes_this_one(recording, found):
    chosen = yaml.safe_load(page.yaml_text('robot3', page.settings(found, BURGER), found))
    config = SimulatorConfig(**chosen)
    assert config.wheel_radius == pytest.approx(0.0325, abs=0.0001)
    assert config.yaw_lag == pytest.approx(0.085, abs=0.02)
    again = driven(config)
    twin = estimates(again, BURGER)
    for name in found:
        if name not in ('sample_delay', 'obeyed_late', 'reset_yaw_deg'):
            assert abs(twin[name].value - found[name].value) <= twin[name].error + found[name].error, name
    assert max(page.agreement(page.both_answers(recording, again)).values()) < 0.03


def test_a_tiny_number_is_a_number_in_the_file():
    text = page.yaml_text('robot3', {'wheel_mismatch': -1e-05, 'model': 'burger'}, {})
    assert yaml.safe_load(text) == {'wheel_mismatch': -1e-05, 'model': 'burger'}


def test_a_clock_that_is_ahead_is_told_and_changes_nothing_else(recording, found):
    ahead = replace(recording, round_trip=0.04, _arrays={}, rows=dict(recording.rows, imu=[
        (stamp + 0.5, *others) for stamp, *others in recording.rows['imu']], odom=[
        (stamp + 0.5, *others) for stamp, *others in recording.rows['odom']], wheels=[
        (stamp + 0.5, *others) for stamp, *others in recording.rows['wheels']]))
    seen = estimates(ahead, BURGER)
    assert seen['clock_offset'].value == pytest.approx(0.5, abs=seen['clock_offset'].error)
    lines = {line.key: line.verdict for line in findings.findings(ahead, seen, BURGER)}
    assert lines.pop('clock_offset') == LOOK and FAULT not in lines.values()
    before, after = page.settings(found, BURGER), page.settings(seen, BURGER)
    for name in ('command_latency', 'sensor_latency', 'yaw_lag', 'wheel_lag', 'motor_lag'):
        assert after[name] == pytest.approx(before[name], abs=0.01), name


def test_the_page_holds_each_line_and_the_figure(recording, found):
    lines = findings.findings(recording, found, BURGER)
    text = page.html('robot<3>', lines, recording, page.settings(found, BURGER), found)
    assert text.count('<tr>') == len(lines) + 1
    assert 'robot&lt;3&gt;: first contact' in text and 'data:image/png;base64,' in text


class Fault:
    """Changes a robot at a moment."""

    def __init__(self, begin, **settings):
        self._begin, self._settings = begin, settings

    def __call__(self, playground):
        if self._settings and playground.robot.now >= self._begin:
            playground.robot.configure(replace(playground.robot.config, **self._settings))
            self._settings = {}


@lru_cache(maxsize=None)
def healthy_marks():
    return driven(SimulatorConfig()).marks


def moment_in(part):
    """Half a second after this part begins, of a robot without faults [s]."""
    return next(mark.begin for mark in healthy_marks() if mark.name == part) + 0.5


@pytest.mark.parametrize('settings, part, keys', [
    (dict(motors_off=True), steps.TURN, 'motors'),
    (dict(imu_frozen=True), steps.ROUNDS, 'imu_frozen'),
    (dict(odom_frozen=True), steps.METRE, 'odom_frozen'),
    (dict(imu_silent=True), steps.REST, 'lost_imu'),
    (dict(odom_silent=True), steps.METRE, 'lost_odom'),
    (dict(network_cut=True), steps.METRE, 'lost_imu_odom'),
    (dict(serial_dead=True), steps.METRE, 'lost_imu_odom'),
    (dict(stalls_per_min=60.0, longest_stall=1.5), steps.REST, 'stalls'),
    (dict(slip=1.0), steps.TURN, 'imu_frozen motors'),
    (dict(gyro_bias_deg=30.0), steps.REST, 'imu_drift_deg_per_min')])
def test_a_fault_is_named_and_the_robot_stands_afterwards(settings, part, keys):
    playground = Playground(SimulatorConfig(), watch=Fault(moment_in(part), **settings))
    recording = playground.run()
    lines = findings.findings(recording, estimates(recording, BURGER), BURGER)
    assert {line.key for line in lines if line.verdict == FAULT} & set(keys.split())
    playground.robot.step(1.5)
    assert playground.robot.true_velocity == pytest.approx((0.0, 0.0), abs=1e-3)


@pytest.mark.parametrize('part', [steps.TURN, steps.FAST_DRIVE, steps.SILENCE, steps.ROUNDS, steps.METRE, steps.RESET])
def test_a_key_stops_the_robot_for_good(part):
    moment, moved = moment_in(part), []

    def watch(playground):
        robot = playground.robot
        if robot.now >= moment:
            playground.ride.end(ride.KEY, robot.now)
    playground = Playground(SimulatorConfig(motor_lag=0.05), watch=watch)
    recording = playground.run()
    assert ride.KEY in recording.ended
    for _ in range(60):
        playground.robot.command(*playground.ride.tick(playground.robot.now).command)
        playground.robot.step(0.1)
        moved.append(playground.robot.true_velocity)
    assert np.abs(moved[6:]).max() < 1e-3
    line = findings.findings(recording, {}, BURGER)[0]
    assert (line.verdict, line.key) == (LOOK, 'ended')


def begun():
    """A ride in the middle of a drive, at time 1."""
    recording = Recording()
    here = Ride(recording, [steps.BY_NAME['metre']])
    hear(here, 0.0, 0.0)
    here.enter(0.0)
    assert here.tick(0.0).command == (steps.DRIVING, 0.0)
    for number in range(1, 101):
        hear(here, 0.01 * number, 0.0015 * number)
        here.tick(0.01 * number)
    return recording, here


def hear(here, now, x):
    here.hear(ImuSample(now, 0.001 * now, 0.0), now)
    here.hear(OdometrySample(now, Pose2(x, 0.0, 0.0), 0.15, 0.0), now)


def test_the_wall_of_the_box_ends_it():
    recording, here = begun()
    hear(here, 1.01, 0.81)
    assert here.tick(1.01).command == (0.0, 0.0) and here.is_over
    assert here.tick(1.02).command == (0.0, 0.0)
    assert ride.WALL in recording.ended and recording.marked(steps.METRE) == []


def test_a_silent_sensor_ends_it():
    recording, here = begun()
    for number in range(101, 168):
        here.hear(ImuSample(0.01 * number, 0.0, 0.0), 0.01 * number)
        here.tick(0.01 * number)
    assert here.phase is Phase.RUNNING
    here.hear(ImuSample(1.71, 0.0, 0.0), 1.71)
    assert here.tick(1.71).command == (0.0, 0.0)
    assert recording.lost == 'odom' and here.phase is Phase.LISTENING
    here.tick(1.72 + ride.LISTENING)
    assert here.is_over


def test_a_program_that_slept_does_not_go_on():
    """The robot has stopped by its own timeout; the step is not taken up again."""
    recording, here = begun()
    hear(here, 2.2, 0.16)               # what waited in the sockets comes first
    assert here.tick(2.2).command == (0.0, 0.0) and here.is_over
    assert findings.findings(recording, {}, BURGER)[0].key == 'stood'


def test_enter_and_numbers_count_only_when_they_are_asked_for():
    recording, here = begun()
    here.enter(1.01)
    here.answer(7.0, 1.01)
    assert here.phase is Phase.RUNNING and recording.answers == {}


class Toy:
    """A robot that obeys at once, on a ride of one step, in ticks of 10 ms. `moves`: its true speed, and `imu`, `odom`:
    what these sensors tell of it, as a share; None: the sensor is silent; 'frozen': it repeats its latest sample."""

    def __init__(self, *parts, heading=0.0, **step):
        self.recording, self.now, self.told, self.resets, self.speed = Recording(), 0.0, [], [], (0.0, 0.0)
        self.ride = Ride(self.recording, [steps.Step(step.pop('name', ''), '', parts, **step)])
        self.moves = self.imu = self.odom = 1.0
        self._heading, self._yaw, self._seen, self._pose = heading, 0.0, 0.0, [0.0, 0.0, heading]
        self._wiggle, self.begin = 1e-4, 0.05
        self.pass_time(0.05)
        self.told.clear()
        self.ride.enter(self.now)

    def pass_time(self, seconds, blind=False):
        """`blind`: nothing comes, and the program does not run."""
        for _ in range(round(100 * seconds)):
            self.now += 0.01
            if not blind:
                self._tick()

    def _tick(self):
        here, (linear, angular), self._wiggle = self.ride, self.speed, -self._wiggle
        if self.imu not in (None, 'frozen'):
            self._yaw += 0.01 * self.moves * self.imu * angular + self._wiggle
        if self.odom not in (None, 'frozen'):
            way, turn = 0.01 * self.moves * self.odom * linear, 0.01 * self.moves * self.odom * angular
            self._pose = [self._pose[0] + way * math.cos(self._heading), self._pose[1] + way * math.sin(self._heading),
                          self._pose[2] + turn + self._wiggle]
        if self.imu is not None:
            here.hear(ImuSample(self.now, math.remainder(self._yaw, 2.0 * math.pi), 0.0), self.now)
        if self.odom is not None:
            x, y, yaw = self._pose
            speed = math.copysign(linear, linear * self.moves * (-1.0 if self.odom == -1.0 else 1.0))
            here.hear(OdometrySample(self.now, Pose2(x, y, math.remainder(yaw, 2.0 * math.pi)), speed, 0.0), self.now)
        order = here.tick(self.now)
        self.resets += [self.now] if order.reset else []
        if order.command is not None:
            self.told.append((self.now - self.begin, order.command))
            self.speed = order.command


def drive(sign=1.0, seconds=30.0, **others):
    return steps.Part('drive', linear=0.02 * sign, seconds=seconds, **others)


def turn(sign=1.0, seconds=30.0, **others):
    return steps.Part('turn', angular=1.0 * sign, seconds=seconds, **others)


PAUSE = steps.Part('', seconds=4.0)
NO_ANSWER, STILL, LOST = ride.STANDS, ride.FROZEN, ride.LOST


@pytest.mark.parametrize('sign', [1.0, -1.0])
@pytest.mark.parametrize('part, at, change, reason, latest', [
    (drive, 0.0, dict(moves=0.0), NO_ANSWER, 1.6), (drive, 0.0, dict(moves=-1.0), NO_ANSWER, 1.6),
    (drive, 8.0, dict(moves=0.0), NO_ANSWER, 11.2), (turn, 8.0, dict(moves=0.0), NO_ANSWER, 11.2),
    (turn, 0.0, dict(moves=0.0), NO_ANSWER, 1.6), (turn, 0.0, dict(moves=-1.0), NO_ANSWER, 1.6),
    (turn, 0.0, dict(imu=-1.0), NO_ANSWER + ', by imu', 1.6), (turn, 0.0, dict(odom=-1.0), NO_ANSWER + ', by odom', 1.6),
    (turn, 3.3, dict(imu='frozen'), STILL + 'imu', 4.0), (turn, 3.3, dict(odom='frozen'), STILL + 'odom', 4.0),
    (drive, 0.0, dict(odom='frozen'), STILL + 'odom', 1.6), (drive, 3.3, dict(odom='frozen'), STILL + 'odom', 4.0),
    (drive, 3.0, dict(imu=None), LOST + 'imu', 3.7), (drive, 3.0, dict(odom=None), LOST + 'odom', 3.7),
    (turn, 0.0, dict(imu=None), LOST + 'imu', 0.7), (turn, 3.0, dict(imu=None, odom=None), LOST + 'imu and odom', 3.7)])
def test_a_robot_that_does_not_follow_or_tell_is_stopped_in_time(sign, part, at, change, reason, latest):
    toy = Toy(part(sign))
    toy.pass_time(at)
    assert toy.recording.ended == ''
    vars(toy).update(change)
    toy.pass_time(30.0)
    assert toy.recording.ended == ': ' + reason and toy.recording.lost == (reason[len(LOST):] if LOST in reason else '')
    moving = [now for now, command in toy.told if command != (0.0, 0.0)]
    assert at + 0.5 < moving[-1] < latest + 0.02 and toy.ride.is_over


@pytest.mark.parametrize('sign', [1.0, -1.0])
@pytest.mark.parametrize('parts', [(turn, 1.2), (drive, 1.2), (turn, 9.0), (drive, 9.0)])
def test_a_rest_after_a_movement_accuses_only_a_robot_that_did_not_move(sign, parts):
    part, seconds = parts
    toy, stands = Toy(part(sign, seconds), PAUSE, PAUSE), Toy(part(sign, seconds), PAUSE)
    toy.pass_time(seconds)
    toy.odom = 'frozen'                 # a robot at rest: its odometry need not change
    stands.moves = 0.0
    for one in (toy, stands):
        one.pass_time(20.0)
    assert toy.recording.ended == '' and NO_ANSWER in stands.recording.ended
    for mark, length in zip(toy.recording.marks, (seconds, 4.0, 4.0)):
        assert mark.end - mark.begin == pytest.approx(length, abs=0.011)


@pytest.mark.parametrize('heading', [0.0, 90.0, 180.0, -90.0])
@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_the_box_has_four_walls(heading, sign):
    part = steps.Part('', linear=0.2 * sign, seconds=20.0)
    toy = Toy(part, heading=math.radians(heading))
    toy.pass_time(20.0)
    assert ride.WALL in toy.recording.ended
    assert [now for now, command in toy.told if any(command)][-1] == pytest.approx(4.0, abs=0.05)


def test_commands_come_with_the_boards_period_and_without_a_burst_after_a_gap():
    toy = Toy(drive())
    toy.pass_time(3.0)
    assert len(toy.told) == pytest.approx(90 + 1, abs=1) and toy.recording.ended == ''
    toy.pass_time(0.5, blind=True)
    toy.pass_time(3.0)
    times = [now for now, _ in toy.told]
    assert len(times) == pytest.approx(180 + 1, abs=2) and toy.recording.ended == ''
    assert np.diff(times).min() > 0.02 and sorted(np.diff(times))[-2] < 0.045
    assert [now - toy.begin for now, *_ in toy.recording.told] == times
    toy.pass_time(1.1, blind=True)
    toy.pass_time(0.01)
    assert ride.STOOD in toy.recording.ended and toy.speed == (0.0, 0.0)


def test_a_silence_is_silent_a_late_command_single_and_a_reset_too():
    toy = Toy(drive(2.0, 1.0), steps.Part('', seconds=1.0, silent=True), steps.Part('', seconds=0.5, resets=True),
              turn(seconds=3.0, once=True), steps.Part('', seconds=0.5), name='x', longest_silence=9.0)
    toy.pass_time(1.3)
    toy.moves = 0.0                     # the firmware's own stop
    toy.pass_time(1.3)
    toy.imu = toy.odom = None           # deaf and silent
    toy.pass_time(2.4)
    toy.imu = toy.odom = 1.0
    toy.pass_time(3.0)
    assert [now for now, _ in toy.told if 1.02 < now < 1.98] == []
    assert [now for now, _ in toy.told if 2.55 < now < 5.4] == []
    assert len(toy.resets) == 1 and toy.resets[0] - toy.begin == pytest.approx(2.01, abs=0.03)
    assert [command for now, command in toy.told if 2.49 < now < 2.55] == [(0.0, 1.0)]
    assert toy.recording.ended == '' and toy.ride.is_over and toy.ride.step.name == 'x'
    toy = Toy(PAUSE, name='reset')
    toy._pose[0] = 2.0                  # the odometry begins anew, elsewhere
    toy.pass_time(5.0)
    assert toy.recording.ended == '' and toy.ride.is_over


@pytest.mark.parametrize('part, length, seconds', [
    (steps.Part('', linear=-0.1, reach=0.5, seconds=9.0), 0.5, 5.0),
    (steps.Part('', angular=-1.0, reach=20.0, seconds=30.0), 20.0, 20.0),
    (steps.Part('', linear=0.1, reach=0.5, seconds=4.0), 0.5, None)])
def test_a_part_ends_where_it_was_to_reach_or_is_too_slow(part, length, seconds):
    toy = Toy(steps.Part('', linear=0.1, seconds=2.0), PAUSE, part, question='How far?')
    toy.pass_time(40.0)
    if seconds is None:
        assert ride.SLOW in toy.recording.ended and math.isnan(toy.recording.marks[-1].end)
        return
    mark = toy.recording.marks[-1]
    assert mark.end - mark.begin == pytest.approx(seconds, abs=0.05)
    assert toy.ride.phase is Phase.ASKING and toy.speed == (0.0, 0.0)
    toy.ride.answer(None, toy.now)
    assert toy.ride.is_over and toy.recording.answers == {}
    toy.ride.end(ride.KEY, toy.now)
    assert toy.recording.ended == ''


def test_a_sensor_that_never_spoke_is_missed_and_its_return_is_heard():
    toy = Toy(turn())
    toy.imu = None
    toy.pass_time(1.0)
    rows, toy.imu = len(toy.recording.rows['imu']), 1.0
    toy.pass_time(1.0)
    toy.ride.end(ride.KEY, toy.now)     # the first reason stays
    assert toy.ride.phase is Phase.LISTENING and len(toy.recording.rows['imu']) == rows + 100
    toy.pass_time(5.0)
    assert toy.ride.is_over and toy.recording.ended.endswith('imu') and toy.speed == (0.0, 0.0)
    rows = len(toy.recording.rows['imu'])
    toy.pass_time(1.0)
    assert len(toy.recording.rows['imu']) == rows
    deaf = Ride(Recording(), [steps.Step('', '', (turn(),))])
    deaf.enter(100.0)                   # nothing was ever heard
    assert [deaf.tick(100.0 + 0.01 * tick).command for tick in (0, 69, 71)] == [(0.0, 1.0), (0.0, 1.0), (0.0, 0.0)]


@pytest.mark.parametrize('step, wrong, right, number', [
    ('metre', ['nan', 'inf', '-inf', '0', '-100', '1.0', '49.9', '150.1', '9999', 'x', '39 inches'], '98,5', 98.5),
    ('metre', [], '50', 50.0), ('metre', [], '150', 150.0), ('rounds', [], '0', 0.0),
    ('rounds', ['nan', '3612', '-361', '1e9'], '-12', -12.0), ('rounds', ['400'], '', None)])
def test_a_number_that_is_not_possible_is_asked_for_again(monkeypatch, capsys, step, wrong, right, number):
    reader, writer = os.pipe()
    with os.fdopen(reader) as keyboard, os.fdopen(writer, 'w') as person:
        monkeypatch.setattr(sys, 'stdin', keyboard)
        person.write('\n'.join(wrong + [right, 'the next line']) + '\n')
        person.flush()
        step, terminal = steps.BY_NAME[step], Terminal()
        assert terminal.number(step) == number
        assert os.read(reader, 20) == b'the next line\n'
    valid = {'metre': '50 to 150 [cm]', 'rounds': '-360 to 360 [degrees]'}[step.name]
    said = capsys.readouterr().out.split(step.question)[1:]
    assert len(said) == len(wrong) + 1 and said[-1].strip() == ''
    for text, answer in zip(wrong, said):
        assert "'{}' is not valid".format(text) in answer and valid in answer


@pytest.mark.parametrize('lag', [0.005, 0.08, 0.4])
def test_a_step_response_is_fitted(lag):
    time = np.arange(-0.3, 1.2, 0.01)
    values = np.where(time < 0.123, 0.0, 1.5 * (time - 0.123 - lag * -np.expm1(-(time - 0.123) / lag)))
    assert travel(time, 0.123, lag, 1.5) == pytest.approx(values, abs=1e-12)
    (delay, fitted, speed), misfit = fit(time, values, 0.1)
    assert (delay, fitted, speed) == pytest.approx((0.123, lag, 1.5), abs=1e-4) and misfit < 1e-6


def test_outliers_are_left_out_of_a_mean():
    value, error = pooled([1.0, 1.1, 0.9, 1.0, 5.0], 0.05, 0.01)
    assert value == pytest.approx(1.0) and 0.08 < error < 0.2


@pytest.mark.parametrize('value, error, verdict', [
    (0.0, 0.1, OK), (2.05, 0.1, OK), (2.2, 0.1, LOOK), (-2.2, 0.1, LOOK), (7.55, 0.1, LOOK), (-7.7, 0.1, FAULT)])
def test_a_number_is_judged_with_its_error(value, error, verdict):
    line, = findings.findings(Recording(), {'imu_drift_deg_per_min': Estimate(value, error)}, BURGER)
    assert line.verdict == verdict


@pytest.mark.parametrize('volts, torque, verdicts', [
    ((12.1, 11.9), True, [OK, OK]), ((11.5, 11.2), True, [LOOK, OK]), ((11.1, 10.9), False, [FAULT, FAULT])])
def test_battery_and_torque_are_told(volts, torque, verdicts):
    lines = findings.findings(Recording(volts=list(volts), torque=torque), {}, BURGER)
    assert [line.verdict for line in lines] == verdicts


def test_a_robot_that_said_nothing_has_no_numbers():
    assert estimates(Recording(), BURGER) == {}
    assert page.settings({}, BURGER) == {'model': 'burger'}
    assert 'first contact' in page.html('robot3', [], Recording(), {}, {})


# ----- the real firmware, where its recordings are: the figures are those of their README

RECORDINGS = pathlib.Path(os.environ.get('TB3_LABS_RECORDINGS', str(
    pathlib.Path(__file__).resolve().parents[3] / 'shared' / 'recordings')))


def firmware(name):
    """The Recording of a bag, with a mark for each command that was held; skips without the bag."""
    path = RECORDINGS / 'firmware_{}.bag'.format(name)
    if not path.exists():
        pytest.skip('{} is absent'.format(path))
    recording, told = Recording(), []
    with rosbag.Bag(str(path)) as bag:
        start = bag.get_start_time()
        for topic, message, moment in bag.read_messages():
            now = moment.to_sec() - start
            if topic == '/imu':
                sample = to_imu_sample(message)
                recording.add(sample._replace(stamp=sample.stamp - start), now)
            elif topic == '/odom':
                sample = to_odometry_sample(message)
                recording.add(replace(sample, stamp=sample.stamp - start), now)
            elif topic == '/cmd_vel':
                told.append((now, message.linear.x, message.angular.z))
            elif topic == '/reset':
                recording.marks.append(Mark('reset', steps.RESET, now, now + 0.5, 0.0, 0.0))
    for part in [list(group) for _, group in groupby(told, lambda row: row[1:])]:
        linear, angular = part[0][1:]
        if linear or angular:
            recording.marks.append(Mark('', steps.DRIVE if linear else steps.TURN, part[0][0],
                                        part[-1][0] + steps.PERIOD, linear, angular))
    return recording


@pytest.mark.parametrize('name, turn, drive', [('drive', 0.0135, 0.0085), ('slow_host', 0.0835, 0.0735)])
def test_the_firmware_answers_with_its_lag_and_dead_time(name, turn, drive):
    """The motors' lag was 50 ms; a command waits 8 ms and half a period; `turn`, `drive`: age at the stamp."""
    found = estimates(firmware(name), BURGER)
    for part, age in (('turn', turn), ('drive', drive)):
        lag, delay = found[part + '_lag'], found[part + '_delay']
        assert abs(lag.value - 0.05) <= lag.error
        assert abs(delay.value - (0.008 + 0.5 / 30.0 + age)) <= delay.error


@pytest.mark.parametrize('name, turned', [
    ('reset_at_rest', 1.90), ('reset_in_drive', 1.83), ('late_commands', 1.85), ('reset_in_spin', 148.8)])
def test_the_firmware_pauses_and_keeps_a_yaw(name, turned):
    found = estimates(firmware(name), BURGER)
    assert 2.5 <= found['reset_pause'].value <= 2.75 and found['reset_place'].value < 0.002
    assert found['reset_yaw_deg'].value == pytest.approx(turned, abs=0.5)


@pytest.mark.parametrize('name, drift', [
    ('reset_in_spin', -57.5), ('calibrated_in_motion', -28.4), ('reset_at_rest', 0)])
def test_the_firmware_drifts_as_it_was_calibrated(name, drift):
    recording = firmware(name)
    end = recording.rows['imu'][-1][1]
    recording.marks.append(Mark('', steps.REST, end - 1.9, end, 0.0, 0.0))
    value, error = estimates(recording, BURGER)['imu_drift_deg_per_min']
    assert value == pytest.approx(60.0 * drift, abs=0.01 * abs(60.0 * drift) + error)
    assert findings.findings(recording, {'imu_drift_deg_per_min': Estimate(value, error)}, BURGER)[-1].verdict == (
        FAULT if drift else OK)
