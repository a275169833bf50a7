"""The lab sheets hold every number that is graded; what their figures show, and those of teaching.md."""
import math
import re
import sys

import pytest
from pages import ROOT

sys.path.insert(0, str(ROOT / 'doc' / 'instructor'))

import make_figures
import make_graded
import make_wrong_figures
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.marks import LABS
from tb3_labs.report.cause.diagnosed_turns import Law


def read(sheet):
    return (ROOT / 'doc' / sheet).read_text(encoding='utf-8')


@pytest.mark.parametrize('sheet', sorted({
    criterion.where.sheet for lab in LABS.values() for criterion in lab.criteria}))
def test_the_sheets_have_the_tables_of_the_code(sheet):
    assert make_graded.with_tables(read(sheet)) == read(sheet)


def test_the_open_todos_that_the_sheets_show_are_those_of_the_skeletons():
    skeletons = ''.join(path.read_text(encoding='utf-8') for path in sorted(
        (ROOT / 'doc' / 'skeletons').glob('*/src/*')))
    shown = [line.strip() for sheet in ('imu_lab.md', 'transformation_lab.md')
             for line in read(sheet).splitlines() if re.match(r' *TODO \d+ is open', line)]
    assert len(shown) > 2 and [line for line in shown if line not in skeletons] == []


def test_every_question_has_an_answer():
    answers = read('instructor/teaching.md').split('## Answers')[1]
    for lab, sheet in (('IMU', 'imu_lab.md'), ('Transformation', 'transformation_lab.md')):
        questions = read(sheet).split('## Questions')[1].split('\n## ')[0]
        assert re.findall(r'^\d+\.', questions, re.M) == re.findall(
            r'^\d+\.', answers.split(lab + ' lab:')[1].split(' lab:')[0], re.M)


# Figures --------------------------------------------------------------------------------------------

#: First line of the title -> the way in which the node of that drive computes its pose.
ENDS = {title.split('\n')[0]: way for title, way in make_wrong_figures.DRIVES}


def test_the_example_of_the_figures_is_that_of_the_sheet():
    sheet = (ROOT / 'doc' / 'transformation_lab.md').read_text(encoding='utf-8')
    B, here = make_figures.A_T_B, make_figures.A_T_ROBOT
    assert 'said ({:g}, {:g}) and {:.2f} degrees'.format(B.x, B.y, math.degrees(B.yaw)) in ' '.join(
        sheet.split())
    assert 'says ({:g}, {:g}) and {:.2f} degrees'.format(
        here.x, here.y, math.degrees(here.yaw)) in ' '.join(sheet.split())


def test_the_drive_of_the_four_states_arrives():
    seen = make_figures.drive()
    states = list(dict.fromkeys(state for _, _, state, *_ in seen))
    assert states[:3] == ['ROTATE_TO_GOAL', 'MOVE_FORWARD', 'ROTATE_TO_FINAL']
    assert seen[-1][1].distance_to(make_figures.GOAL) < make_figures.NEAR + 0.02


@pytest.mark.parametrize('title', sorted(ENDS))
def test_only_the_right_node_ends_at_the_goal(title):
    way = ENDS[title]
    true, _ = make_wrong_figures.drive(
        way, make_wrong_figures.ELSEWHERE if way.mistake == 'declared_lost' else Pose2())
    missed = true[-1].distance_to(make_wrong_figures.GOAL)
    if title == 'as it should be':
        assert missed < make_wrong_figures.NEAR and abs(true[-1].yaw) < 0.05
    else:
        assert missed > 2.0 * make_wrong_figures.NEAR


@pytest.mark.parametrize('start, side', [(330.0, 1.0), (40.0, -1.0)])
@pytest.mark.parametrize('law, ends', [(Law(), True), (make_wrong_figures.UNWRAPPED, False)])
def test_a_turn_ends_if_it_is_wrapped(start, side, law, ends):
    turned = make_wrong_figures.turn(start, side, law)
    assert (abs(turned[-1] - start - 90.0 * side) < 10.0) == ends


def test_every_figure_is_drawn():
    for folder, figures in (('doc', {**make_figures.FIGURES, **make_wrong_figures.STUDENTS}),
                            ('doc/instructor', make_wrong_figures.FIGURES)):
        assert {path.stem for path in (ROOT / folder / 'figures').glob('*.svg')} == set(figures)
