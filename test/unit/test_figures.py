"""The figures of a made-up run: their curves and their blanks."""
import math

import numpy as np
import pytest
from made_run import TIME, X, ZERO, driven, goals, made, poses, turn

from tb3_labs.recording.run_data import OdometrySamples, Poses
from tb3_labs.report.motion.drives import drive_reports

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from tb3_labs.report.motion.movements import with_derived_fields
from tb3_labs.report.page.printed_figures import draw_path, new_figure, paths_figure, turns_figure


def lines(axes, label=None):
    return [line.get_xydata() for line in axes.get_lines()
            if label is None or line.get_label() == label]


def test_turns_are_drawn_from_their_begin_in_the_direction_that_was_asked_for():
    """The second turn begins within the time that the figure shows after the first turn."""
    first = turn(2.0, 90.0)
    left, rate = turns_figure(driven([first, turn(first[1] + 0.5, -90.0)])).axes
    assert (left.get_ylabel(), rate.get_xlabel()) == (
        'angle left [deg]', 'time since the first command [s]')
    legend, = left.figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ['1: +90 deg', '2: -90 deg', 'commanded']
    for k, rest in enumerate((0.5, 0.6)):
        angle, speed = lines(left)[k], lines(rate, 'commanded' if not k else None)[0]
        assert angle[[0, -1], 0] == pytest.approx((-0.2, first[1] - first[0] + rest), abs=0.015)
        assert angle[[0, -1], 1] == pytest.approx((90.0, 0.0), abs=0.2)
        assert speed[:, 1].max() == pytest.approx(1.5) and speed[:, 1].min() > -0.01


@pytest.mark.parametrize('leap, pieces', [(0.29, 1), (-0.31, 2)])
def test_a_path_is_blank_where_it_leaps_by_more_than_three_tenths_of_a_metre(leap, pieces):
    axes = new_figure(2.0).subplots()
    draw_path(axes, poses(ZERO, np.where(TIME > 5.0, leap, 0.0)), color='black', label='path')
    line, = lines(axes, 'path')
    assert np.isnan(line).any(axis=1).sum() == pieces - 1 == len(line) - len(TIME)


def test_both_panels_of_the_paths_hold_both_frames():
    """The robot stands in odom at (3, -2), turned by 90 deg; local is declared where it stands."""
    run = with_derived_fields(made(
        local_pose=Poses.none(), goals=goals([0.5], [1.0]), odometry=OdometrySamples(
            TIME, TIME, ZERO + 3.0, X - 2.0, ZERO + math.pi / 2.0, ZERO, ZERO)))
    in_odom, in_local = paths_figure(run, drive_reports(run)).axes
    for axes, name, first, last in ((in_odom, 'path', (3.0, -2.0), (3.0, -1.0)), (in_odom, 'goal', (3.0, -1.0), None),
                                    (in_local, 'path', (0.0, 0.0), (1.0, 0.0)), (in_local, 'goal', (1.0, 0.0), None)):
        line, = lines(axes, name)
        assert line[0] == pytest.approx(first, abs=1e-9) and line[-1] == pytest.approx(last or first, abs=1e-9)
    legend, = in_odom.figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ['path', 'start', 'end', 'goal']
