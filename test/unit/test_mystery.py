"""Mystery robots. Each fault changes the simulated robot. Answers get right verdicts."""
import runpy
from dataclasses import replace

import pytest
from pages import ROOT, SCRIPTS

from tb3_labs.simulation import mystery_robot
from tb3_labs.simulation.mystery_robot import FAULT_KINDS, LAST_NUMBER, HiddenFault, fault_of
from tb3_labs.simulation.simulator_config import SimulatorConfig

judge = runpy.run_path(str(SCRIPTS / 'mystery.py'))['judge']
#: {fault: what it changes in a robot whose fault has the value 2}
CHANGES = {
    'imu offset': {'imu_offset_deg': 2.0}, 'imu drift': {'imu_drift_deg_per_min': 2.0},
    'wheel mismatch': {'wheel_mismatch': 0.02}, 'slip': {'slip': 0.02},
    'frozen imu': {'imu_frozen': True}, 'frozen odometry': {'odom_frozen': True},
    'silent imu': {'imu_silent': True}, 'silent odometry': {'odom_silent': True},
    'sensor latency': {'sensor_latency': 2.0}, 'command latency': {'command_latency': 2.0},
    'network stalls': {'longest_stall': 2.0, 'stalls_per_min': 30.0}}


@pytest.mark.parametrize('kind', FAULT_KINDS, ids=lambda kind: kind.name)
def test_a_fault_is_a_change_of_the_robot_in_the_unit_of_its_value(kind, monkeypatch):
    """A fault that comes and goes has begun after 12 s."""
    monkeypatch.setattr(mystery_robot, 'fault_of', lambda number: (kind, 2.0, 7))
    sound = SimulatorConfig(imu_rate=40.0)
    faulty = HiddenFault(1, sound).settings_at(12.5)
    assert faulty == replace(sound, seed=7, **CHANGES[kind.name])


#: Answers in an instructor's key. They must stay the same in each Python, and in each later version.
KEPT = {1: ('network stalls', 0.65), 3: ('wheel mismatch', 7.7), 4: ('imu offset', 115.0),
        7: ('command latency', 0.52), 15: ('wheel mismatch', -3.5), 19: ('imu drift', -25.0),
        LAST_NUMBER: ('sensor latency', 0.5)}


@pytest.fixture(scope='module')
def drawn():
    """Returns {number: (fault, value)} for the first numbers."""
    return {number: fault_of(number)[:2] for number in range(1, 2003)}


def test_a_number_always_gives_the_same_robot(drawn):
    assert {number: (fault_of(number)[0].name, fault_of(number)[1]) for number in KEPT} == KEPT
    assert sum(drawn[number][1] for number in range(1, 1001)) == pytest.approx(3841.06)
    # faults are evenly spread, and neighbours differ
    names = [fault.name for fault, _ in drawn.values()]
    assert all(a != b for a, b in zip(names, names[1:]))
    for first in range(0, len(names), len(FAULT_KINDS)):
        assert len(set(names[first:first + len(FAULT_KINDS)])) == len(FAULT_KINDS)


@pytest.mark.parametrize('kind', FAULT_KINDS, ids=lambda kind: kind.name)
def test_values_fill_their_range_and_a_guess_is_seldom_right(kind, drawn):
    values = [value for fault, value in drawn.values() if fault is kind]
    low, high = kind.value_range
    sizes, tolerance = sorted(map(abs, values)), kind.tolerance
    assert low <= sizes[0] < low + 0.1 * (high - low) and high - 0.1 * (high - low) < sizes[-1] <= high
    assert kind.is_signed == (min(values) < 0.0)
    assert 2.0 * tolerance < (high - low) * (2.0 if kind.is_signed else 1.0) / 3.0
    assert low > 2.0 * tolerance     # the answer 0 is never right


def test_a_fault_comes_and_goes_or_is_always_there():
    hidden = HiddenFault(2, SimulatorConfig())      # the IMU sends for 12 s, then is silent for 3.5 s
    silent = [hidden.settings_at(0.5 * step).imu_silent for step in range(63)]
    assert silent == ([False] * 24 + [True] * 7) * 2 + [False]
    constant = HiddenFault(4, SimulatorConfig())
    assert len({id(constant.settings_at(0.1 * step)) for step in range(300)}) == 1


RIGHT, WRONG = 'Right', 'The fault is right, its value is not'


@pytest.mark.parametrize('number, name, value, verdict', [
    (4, 'imu offset', 118.0, RIGHT), (4, 'imu offset', 112.0, RIGHT),
    (4, 'imu offset', 475.0, RIGHT), (4, 'imu offset', -246.0, RIGHT),
    (15, 'wheel mismatch', -4.0, RIGHT), (7, 'command latency', 0.42, RIGHT),
    (4, 'imu offset', 118.2, WRONG), (4, 'imu offset', -65.0, WRONG),
    (15, 'wheel mismatch', -4.1, WRONG), (7, 'command latency', 0.0, WRONG)])
def test_the_value_of_the_right_fault(number, name, value, verdict):
    is_right, words = judge(number, name, value)
    assert is_right is (verdict is RIGHT) and words.startswith(verdict)


@pytest.mark.parametrize('number', range(1, 12))
def test_the_verdict_on_a_wrong_fault_hides_the_right_fault(number):
    hidden, value, _ = fault_of(number)
    for kind in FAULT_KINDS:
        wrong = 'Wrong: mystery {} has another fault.'.format(number)
        is_right, words = judge(number, kind.name, value)
        assert is_right == (kind is hidden) == (words != wrong)


@pytest.fixture
def command(capsys):
    """Runs the script. Returns (exit status, output, errors)."""
    main = runpy.run_path(str(SCRIPTS / 'mystery.py'))['main']

    def run(*words):
        try:
            status = main(list(words))
        except SystemExit as ended:
            status = ended.code
        return (status, *capsys.readouterr())
    return run


def test_the_command_ends_with_0_for_the_right_answer_alone(command):
    assert command('15', 'Wheel mismatch', '-3.4')[0] == 0
    for words in ['15', 'slip', '12'], ['15', 'wheel mismatch', '9'], ['15', 'wheel mismatch', 'nan']:
        status, out, errors = command(*words)
        assert (status, errors) == (1, '') and len(out.splitlines()) == 1


@pytest.mark.parametrize('words, reason', [
    ('x slip 3', "'x'"), ('0 slip 3', '1 to 9999'), ('10000 slip 3', '1 to 9999'), ('-3 slip 3', '1 to 9999'),
    ('7 rust 130', "invalid choice: 'rust' (choose from "), ('7 slip much', "'much'")])
def test_an_invalid_answer_is_refused_in_one_line(command, words, reason):
    status, out, errors = command(*words.split(' '))
    assert (status, out, len(errors.splitlines())) == (2, '', 1) and reason in errors


def test_the_key_agrees_with_the_judge(monkeypatch, capsys):
    monkeypatch.setattr('sys.argv', ['mystery_key.py', '1', '30'])
    runpy.run_path(str(ROOT / 'doc' / 'instructor' / 'mystery_key.py'))
    rows = [line.split() for line in capsys.readouterr().out.splitlines()[1:]]
    assert [int(row[0]) for row in rows] == list(range(1, 31))
    for row in rows:
        is_right, words = judge(int(row[0]), ' '.join(row[1:-4]), float(row[-4]))
        assert is_right and ' '.join(row[-4:-2]) in words
