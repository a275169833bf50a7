"""The verdict on an answer to a mystery robot, and the command."""
import importlib.util

import pytest

from pages import SCRIPTS
from tb3_labs.simulation.mystery import KINDS, LAST, draw, fault_called, judge

# Of the key: 4 is an imu offset of 115 deg, 15 a wheel mismatch of -3.5 %, 7 a command latency.


def command(capsys, *words):
    """(exit status, output, errors) of the script's main."""
    spec = importlib.util.spec_from_file_location('mystery', str(SCRIPTS / 'mystery.py'))
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    status = script.main(list(words))
    return (status,) + tuple(capsys.readouterr())


RIGHT, WRONG, SIGN = 'Right', 'The fault is right, its value is not', 'the sign is not'


@pytest.mark.parametrize('number, name, value, off, verdict', [
    (4, 'imu offset', 115.0, '0 deg', RIGHT), (4, 'IMU Offset', 118.0, '3 deg', RIGHT),
    (4, 'imu_offset', 112.0, '3 deg', RIGHT), (4, 'offset  imu', 475.0, '0 deg', RIGHT),
    (4, 'imu-offset', -246.0, '1 deg', RIGHT), (15, 'wheel mismatch', -4.0, '0.5 %', RIGHT),
    (15, 'wheel mismatch', -3.0, '0.5 %', RIGHT), (7, 'command latency', 0.42, '0.1 s', RIGHT),
    (4, 'imu offset', 118.2, '3.2 deg', WRONG), (4, 'imu offset', -65.0, '180 deg', WRONG),
    (15, 'wheel mismatch', -4.1, '0.6 %', WRONG), (7, 'command latency', 0.0, '0.52 s', WRONG),
    (4, 'imu offset', -116.0, '129 deg', SIGN), (15, 'wheel mismatch', 3.5, '7 %', SIGN)])
def test_the_value_of_the_right_fault(number, name, value, off, verdict):
    is_right, words = judge(number, name, value)
    assert is_right is (verdict is RIGHT) and words.startswith(RIGHT if is_right else WRONG)
    assert 'off by {}{}'.format(off, '.' if is_right else ';') in words
    assert (SIGN in words) is (verdict is SIGN)


@pytest.mark.parametrize('number', range(1, 12))
def test_a_wrong_fault_tells_nothing_of_the_right_one(number):
    hidden, value, _ = draw(number)
    for kind in KINDS:
        is_right, words = judge(number, kind.name, value)
        assert is_right == (kind is hidden)
        if kind is not hidden:
            assert words == 'Wrong: mystery {} has another fault. If it were {!r}: {}'.format(
                number, kind.name, kind.shows)


@pytest.mark.parametrize('wrong, near', [
    ('imu ofset', 'imu offset'), ('Wheel missmatch', 'wheel mismatch'), ('ghosts', None)])
def test_an_unknown_fault_is_told_the_valid_ones(wrong, near):
    with pytest.raises(ValueError) as problem:
        fault_called(wrong)
    assert all(kind.name in str(problem.value) for kind in KINDS)
    assert ('Did you mean {!r}?'.format(near) in str(problem.value)) == bool(near)


def test_the_command_ends_with_0_for_the_right_answer_alone(capsys):
    assert command(capsys, '--answer', '15', 'wheel mismatch', '-3.4')[0] == 0
    assert command(capsys, '--answer', '15', 'wheel', 'mismatch', '-3.4')[0] == 0
    for words in (['15', 'wheel mismatch'], ['15', 'slip', '12'], ['15', 'wheel mismatch', '9']):
        status, out, errors = command(capsys, '--answer', *words)
        assert (status, errors) == (1, '') and len(out.splitlines()) == 1


@pytest.mark.parametrize('words, told', [
    (['x', 'slip', '3'], '1 to 9999'), (['0', 'slip', '3'], '1 to 9999'),
    ([str(LAST + 1), 'slip'], '1 to 9999'), (['-3', 'slip'], '1 to 9999'),
    (['7', 'slip', 'nan'], 'a number in %'), (['7', 'slip', 'inf'], 'a number in %'),
    (['7'], 'Valid: '), (['7', '130'], 'Valid: '), (['7', 'slip', 'much'], 'Valid: ')])
def test_what_is_no_answer_is_one_line(capsys, words, told):
    status, out, errors = command(capsys, '--answer', *words)
    assert (status, out, len(errors.splitlines())) == (2, '', 1) and told in errors


def test_the_list_describes_each_fault_and_tells_no_number(capsys):
    status, out, _ = command(capsys, '--list')
    assert status == 0 and max(map(len, out.splitlines())) <= 100
    for kind in KINDS:
        assert '\n{}\n  value [{}]'.format(kind.name, kind.unit) in '\n' + out


def test_the_key_agrees_with_the_judge(capsys):
    status, out, _ = command(capsys, 'key', '1-30', '9999')
    rows = [line.split() for line in out.splitlines()[1:]]
    assert status == 0 and [int(row[0]) for row in rows] == list(range(1, 31)) + [9999]
    for row in rows:
        name = ' '.join(row[1:-4])
        assert judge(int(row[0]), name, float(row[-4]))[1].endswith('off by 0 ' + row[-3] + '.')


@pytest.mark.parametrize('words', [
    ['0'], ['1-10000'], ['5-1'], ['x'], ['1-'], ['-3x'], ['1-2-3'], [''], []])
def test_a_key_for_no_number_is_refused(capsys, words):
    status, out, errors = command(capsys, 'key', *words)
    assert (status, out, len(errors.splitlines())) == (2, '', 1)
