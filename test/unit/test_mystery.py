"""Mystery robots. Each fault can be found and measured from samples and commands alone. Answers get
right verdicts."""
import math
import runpy
import statistics
from itertools import groupby

import pytest
from pages import ROOT, SCRIPTS
from simulated import imu_of, odom_of

from tb3_labs.geometry.angles import wrap
from tb3_labs.simulation.mystery_robot import FAULT_KINDS, LAST_NUMBER, HiddenFault, draw
from tb3_labs.simulation.simulator import Simulator
from tb3_labs.simulation.simulator_config import SimulatorConfig

judge = runpy.run_path(str(SCRIPTS / 'mystery.py'))['judge']
STEP = 0.02
#: The commands of the sheet as (end [s], linear [m/s], angular [rad/s]).
RUN = (60.0, 0.0, 0.0), (80.0, 0.1, 0.0), (84.0, 0.0, 0.0), (104.0, 0.0, 1.0), (120.0, 0.0, 0.0)
LAST_COMMAND = 80.0 - STEP      # the time of the last command of the straight drive [s]
COMMAND_TIMEOUT = 0.5           # the robot stops this long after the last command [s]
STRAIGHT = 60.0, 83.0           # the straight drive, with a late end [s]
WHEEL_DISTANCE = 0.160          # the distance of a Burger's wheels in its data sheet [m]


def record(number):
    """Returns [(arrival, sample)] of a robot that follows the commands of the sheet."""
    hidden = HiddenFault(number, SimulatorConfig(imu_rate=40.0))
    robot, seen = Simulator(hidden.settings_at(0.0)), []
    for until, linear, angular in RUN:
        while robot.now < until - 1e-6:
            if linear or angular:
                robot.command(linear, angular)
            if hidden.settings_at(robot.now) is not robot.config:
                robot.configure(hidden.settings_at(robot.now))
            for burst in robot.step_in_bursts(STEP):
                seen += [(robot.now, sample) for sample in burst]
    return seen


def between(samples, begin, end):
    return [sample for sample in samples if begin <= sample.stamp <= end]


def turned(samples):
    """Returns the turn of the IMU from the first to the last sample [rad]."""
    return sum(wrap(b.yaw - a.yaw) for a, b in zip(samples, samples[1:]))


def gaps(moments):
    return [b - a for a, b in zip(moments, moments[1:])]


def usual(times):
    """Returns the median of the times that are longer than a second; 0 without such times [s]. The last one is left
    out, since the end of the run may cut it off."""
    long = [time for time in times if time > 1.0]
    return statistics.median(long[:-1] or long or [0.0])


def symptoms(seen):
    """Yields (fault, value, limit) as a student measures them, step by step. A value above its limit is a fault."""
    samples = [sample for _, sample in seen]
    imu, odom = imu_of(samples), odom_of(samples)
    # 1. The topics, by rostopic delay and rostopic hz.
    delays = [arrival - sample.stamp for arrival, sample in seen]
    yield 'sensor latency', statistics.median(delays), 0.1
    for name, stream, content in (('imu', imu, lambda sample: sample.yaw),
                                  ('odometry', odom, lambda sample: sample.pose)):
        yield 'silent ' + name, usual(gaps([sample.stamp for sample in stream])), 1.0
        repeated = [[sample.stamp for sample in same] for _, same in groupby(stream, content)]
        yield 'frozen ' + name, usual(same[-1] - same[0] for same in repeated), 1.0
    yield 'network stalls', max(gaps([arrival for arrival, _ in seen])), 0.3
    # 2. At rest.
    yield 'imu offset', math.degrees(wrap(imu[0].yaw - odom[0].pose.yaw)), 5.0
    yield 'imu drift', math.degrees(turned(between(imu, 0.0, 50.0))) / 50.0 * 60.0, 5.0
    # 3. The end of a drive, a straight drive, a turn on the spot. A sound robot stops 0.07 s after the timeout, by
    #    the tick of its board, the lag of its motors, and the interval of its odometry.
    stops = next(sample.stamp - LAST_COMMAND for sample in between(odom, LAST_COMMAND, 82.0)
                 if sample.linear < 0.05)
    yield 'command latency', stops - COMMAND_TIMEOUT - 0.07, 0.15
    places = [sample.pose for sample in between(odom, *STRAIGHT)]
    path = sum(a.distance_to(b) for a, b in zip(places, places[1:]))
    bend = -turned(between(imu, *STRAIGHT)) * WHEEL_DISTANCE / path
    yield 'wheel mismatch', 100.0 * bend, 1.0
    rate = statistics.mean(sample.yaw_rate for sample in between(imu, 86.0, 104.0))
    yield 'slip', 100.0 * (1.0 - rate / 1.0), 0.0


@pytest.mark.parametrize('number', range(1, len(FAULT_KINDS) + 1))
def test_a_student_finds_fault_and_value_from_the_samples(number):
    is_right, words = judge(number, *next(
        (fault, value) for fault, value, limit in symptoms(record(number)) if abs(value) > limit))
    assert is_right, words


# ----- the numbers -----

#: Answers in an instructor's key. They must stay the same in each Python, and in each later version.
KEPT = {1: ('network stalls', 0.65), 3: ('wheel mismatch', 7.7), 4: ('imu offset', 115.0),
        7: ('command latency', 0.52), 15: ('wheel mismatch', -3.5), 19: ('imu drift', -25.0),
        LAST_NUMBER: ('sensor latency', 0.5)}


@pytest.fixture(scope='module')
def drawn():
    """Returns number -> (fault, value) for the first numbers."""
    return {number: draw(number)[:2] for number in range(1, 2003)}


def test_a_number_is_the_same_robot_for_ever(drawn):
    assert {number: (draw(number)[0].name, draw(number)[1]) for number in KEPT} == KEPT
    assert sum(drawn[number][1] for number in range(1, 1001)) == pytest.approx(3841.06)
    # faults are evenly spread, and neighbours differ
    names = [fault.name for fault, _ in drawn.values()]
    assert all(a != b for a, b in zip(names, names[1:]))
    for first in range(0, len(names), len(FAULT_KINDS)):
        assert len(set(names[first:first + len(FAULT_KINDS)])) == len(FAULT_KINDS)


@pytest.mark.parametrize('kind', FAULT_KINDS, ids=lambda kind: kind.name)
def test_values_fill_their_range_and_no_guess_is_right_for_a_third_of_it(kind, drawn):
    values = [value for fault, value in drawn.values() if fault is kind]
    low, high = kind.value_range
    sizes, tolerance = sorted(map(abs, values)), kind.tolerance
    assert low <= sizes[0] < low + 0.1 * (high - low) and high - 0.1 * (high - low) < sizes[-1] <= high
    assert kind.signed == (min(values) < 0.0)
    assert 2.0 * tolerance < (high - low) * (2.0 if kind.signed else 1.0) / 3.0
    assert low > 2.0 * tolerance     # the answer 0 is never right


def test_a_fault_comes_and_goes_or_is_always_there():
    hidden = HiddenFault(2, SimulatorConfig())      # the IMU sends for 12 s, then is silent for 3.5 s
    silent = [hidden.settings_at(0.5 * step).imu_silent for step in range(63)]
    assert silent == ([False] * 24 + [True] * 7) * 2 + [False]
    for number in range(1, 500):
        hidden = HiddenFault(number, SimulatorConfig())
        if hidden.fault.value_field:
            first = hidden.settings_at(0.0)
            assert getattr(first, hidden.fault.value_field) == hidden.value * hidden.fault.scale
            assert all(hidden.settings_at(0.1 * step) is first for step in range(300))


# ----- the verdict on an answer -----

RIGHT, WRONG = 'Right', 'The fault is right, its value is not'


@pytest.mark.parametrize('number, name, value, verdict', [
    (4, 'IMU Offset', 118.0, RIGHT), (4, 'imu offset', 112.0, RIGHT),
    (4, 'imu offset', 475.0, RIGHT), (4, 'imu offset', -246.0, RIGHT),
    (15, 'wheel mismatch', -4.0, RIGHT), (7, 'command latency', 0.42, RIGHT),
    (4, 'imu offset', 118.2, WRONG), (4, 'imu offset', -65.0, WRONG),
    (15, 'wheel mismatch', -4.1, WRONG), (7, 'command latency', 0.0, WRONG)])
def test_the_value_of_the_right_fault(number, name, value, verdict):
    is_right, words = judge(number, name, value)
    assert is_right is (verdict is RIGHT) and words.startswith(verdict)


@pytest.mark.parametrize('number', range(1, 12))
def test_a_wrong_fault_tells_nothing_of_the_right_one(number):
    hidden, value, _ = draw(number)
    for kind in FAULT_KINDS:
        wrong = 'Wrong: mystery {} has another fault.'.format(number)
        is_right, words = judge(number, kind.name, value)
        assert is_right == (kind is hidden) == (words != wrong)


# ----- the command -----

@pytest.fixture
def command(capsys):
    """Runs the script. Returns (exit status, output, errors)."""
    main = runpy.run_path(str(SCRIPTS / 'mystery.py'))['main']
    return lambda *words: (main(list(words)), *capsys.readouterr())


def test_the_command_ends_with_0_for_the_right_answer_alone(command):
    assert command('--answer', '15', 'wheel mismatch', '-3.4')[0] == 0
    for words in ['15', 'slip', '12'], ['15', 'wheel mismatch', '9'], ['15', 'wheel mismatch', 'nan']:
        status, out, errors = command('--answer', *words)
        assert (status, errors) == (1, '') and len(out.splitlines()) == 1


@pytest.mark.parametrize('words, told', [
    ('x slip 3', "'x'"), ('0 slip 3', '1 to 9999'), ('10000 slip 3', '1 to 9999'), ('-3 slip 3', '1 to 9999'),
    ('7 rust 130', 'Valid: '), ('7 slip much', "'much'")])
def test_what_is_no_answer_is_one_line(command, words, told):
    status, out, errors = command('--answer', *words.split(' '))
    assert (status, out, len(errors.splitlines())) == (2, '', 1) and told in errors


def test_the_key_agrees_with_the_judge(monkeypatch, capsys):
    monkeypatch.setattr('sys.argv', ['mystery_key.py', '1', '30'])
    runpy.run_path(str(ROOT / 'doc' / 'instructor' / 'mystery_key.py'))
    rows = [line.split() for line in capsys.readouterr().out.splitlines()[1:]]
    assert [int(row[0]) for row in rows] == list(range(1, 31))
    for row in rows:
        is_right, words = judge(int(row[0]), ' '.join(row[1:-4]), float(row[-4]))
        assert is_right and ' '.join(row[-4:-2]) in words
