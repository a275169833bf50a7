"""Each student's own numbers: by the name, in the skeleton, and as the goal that is judged."""
import math
import pathlib

import numpy as np
import pytest
from test_refusals import main_of

from tb3_labs.geometry.angles import difference_degrees
from tb3_labs.handout.skeletons import FOLDER, skeleton
from tb3_labs.marking.marks import LABS
from tb3_labs.marking.move2goal import ANGLE, DISTANCE
from tb3_labs.marking.own_numbers import OwnNumbers, own_numbers, with_own
from tb3_labs.report.run_data import ImuSamples, OdometrySamples, RunData
from tb3_labs.simulation.mystery import LAST

ROOT = pathlib.Path(__file__).resolve().parents[2]
CLASS = [first + ' ' + last for first in ('Ann', 'Bo', 'Chen', 'Dana', 'Eve', 'Finn', 'Gül')
         for last in ('Miller', 'Smith', 'Li', 'Novak', 'Okoye', 'Rossi')]
ANN = OwnNumbers((0.73, -0.65, 130.0), (0.0, 1.4, 40.0), 118, 3687)


@pytest.mark.parametrize('name', ['Miller, Ann', 'millerann', 'ANN  MILLER', 'Ann Miller (12345)',
                                  'Änn Miller'])
def test_a_name_in_any_spelling_has_the_same_numbers(name):
    """They are the same on every computer, and stay so."""
    assert own_numbers(name) == ANN


def test_a_name_without_a_letter_is_refused():
    with pytest.raises(ValueError, match='it has no letter'):
        own_numbers('12 _')


def test_the_numbers_of_a_class_are_possible_and_differ():
    found = [own_numbers(name) for name in CLASS]
    for one in found:
        assert 0.79 < math.hypot(*one.goal[:2]) < 1.01 and one.goal[2] % 10.0 == 0.0
        assert max(map(abs, one.start[:2])) <= 2.0 and 20 <= one.imu_offset < 160
        assert 1 <= one.mystery <= LAST
    assert len({one.mystery for one in found}) > 0.95 * len(CLASS)
    alike = [1 for one in found for other in found if one is not other
             and math.dist(one.goal[:2], other.goal[:2]) < DISTANCE
             and abs(difference_degrees(one.goal[2], other.goal[2])) < ANGLE]
    assert len(alike) < 0.02 * len(CLASS) ** 2


@pytest.mark.parametrize('lab, changed', [
    ('imu', {'launch/imu.launch'}), ('turn', {'launch/turn.launch'}),
    ('gamepad', {'launch/gamepad.launch'}),
    ('move2goal', {'launch/move2goal.launch', 'src/move2goal_tf.py'})])
def test_a_skeleton_holds_the_numbers(lab, changed):
    given = skeleton(ROOT / FOLDER / lab, LABS[lab].packages[0])
    own = with_own(given, ANN)
    assert {name for name in given if given[name] != own[name]} == changed
    start = '{{start_x: {:.1f}, start_y: {:.1f}, start_yaw_deg: {:g}, imu_offset_deg: {}}}'.format(
        *ANN.start, ANN.imu_offset)
    assert 'name="robot_set" default="{}"'.format(start) in own['launch/{}.launch'.format(lab)]
    if lab == 'move2goal':
        lines = [line.strip() for line in own['src/move2goal_tf.py'].splitlines()]
        assert [line for line in lines if line.startswith('self.goal_')] == [
            'self.goal_x = {:g}'.format(ANN.goal[0]), 'self.goal_y = {:g}'.format(ANN.goal[1]),
            'self.goal_yaw = math.radians({:g})'.format(ANN.goal[2])]


@pytest.mark.parametrize('start, offset, own', [
    ((0.01, 1.38, 41.0), 117.0, True), ((0.01, 1.38, 401.0), -243.0, True),
    ((0.0, 0.0, 0.0), 0.0, False), ((0.0, 1.4, 40.0), 0.0, False), ((0.0, 1.4, 140.0), 118.0, False),
    ((0.0, 1.3, 40.0), 118.0, False), ((0.0, 1.4, 40.0), math.nan, False)])
def test_a_recording_is_recognized_by_its_start_and_offset(start, offset, own):
    assert ANN.recorded(start, offset) is own


def test_the_report_tells_whose_recording_it_is():
    whose = main_of('lab_report.py').__globals__['whose']
    times = np.arange(0.0, 2.0, 0.02)
    ones = np.ones(len(times))
    heading, offset = math.radians(ANN.start[2]), math.radians(ANN.imu_offset)
    run = RunData('ann.bag', 0.0, 2.0, ImuSamples(times, times, (heading + offset) * ones, 0.0 * ones),
                  OdometrySamples(times, times, ANN.start[0] * ones, ANN.start[1] * ones,
                                  heading * ones, 0.0 * ones, 0.0 * ones))
    assert 'degrees: the numbers of Ann Miller' in whose(run, 'Ann Miller')
    assert 'degrees: not the numbers of Bo Chen' in whose(run, 'Bo Chen')


def test_the_command_writes_and_tells_them(tmp_path, capsys, monkeypatch):
    main = main_of('skeleton.py')
    # The suite's temporary folder is within this package, where the command refuses to write.
    monkeypatch.setitem(main.__globals__, 'checked_place', lambda place: place)
    assert main(['move2goal', str(tmp_path), '--student', 'Ann Miller']) == 0
    assert 'Your numbers: {}.'.format(ANN) in capsys.readouterr().out
    assert 'self.goal_x = {:g}\n'.format(ANN.goal[0]) in (
        tmp_path / 'lab7_tf' / 'src' / 'move2goal_tf.py').read_text()
