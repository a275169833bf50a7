"""What the figures of the lab sheets and of doc/instructor/teaching.md show."""
import math
import sys

import pytest
from pages import ROOT

sys.path.insert(0, str(ROOT / 'doc' / 'instructor'))

import make_figures
import make_wrong_figures
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.report.cause.diagnosed_turns import Law

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
