"""Draws the figures of a run for a printed report: the turns, and the paths in odom and local.

The lines differ in style and width, so that a figure can be read in black and white.

Units: metres, degrees, rad/s, seconds since a turn's first command. Sizes are in inches.
"""
import math
import os
from io import BytesIO
from typing import Any, Dict, Sequence

import numpy as np

# matplotlib would read a stranger's matplotlibrc in the current folder
_HERE = os.open('.', os.O_PATH)
os.chdir('/')
try:
    import matplotlib
finally:
    os.fchdir(_HERE)
    os.close(_HERE)
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.recording.run_data import Poses, RunData
from tb3_labs.report.motion.drives import DriveReport, frame_interval_of
from tb3_labs.report.motion.resets_and_goals import frame_intervals, local_in_odom, true_poses
from tb3_labs.report.motion.turns import HEADING_MEAN_TIME, turn_reports

DOTS_PER_INCH = 150
WIDTH = 7.2     # [inch], the width of an A4 page between its margins
BLUE, ORANGE, GREEN, GREY = '#1f4e9c', '#d1660a', '#2a7a3a', '#555555'
#: (colour, line style) of successive curves.
STYLES = ((BLUE, '-'), (ORANGE, '--'), (GREEN, '-.'), ('#7a3a8a', ':'))
# the renderer Agg in Noetic fails on a longer line, so matplotlib draws the line in parts
matplotlib.rcParams['agg.path.chunksize'] = 20000
#: The figure of a turn also shows these times [s] before and after the turn.
SHOWN_TIME_BEFORE = 0.2
SHOWN_TIME_AFTER = 2.0 * HEADING_MEAN_TIME


def png(figure: Figure) -> bytes:
    file = BytesIO()
    figure.savefig(file, format='png', dpi=DOTS_PER_INCH, bbox_inches='tight',
                   metadata={'Software': None})
    return file.getvalue()


def new_figure(height: float) -> Figure:
    """Returns an empty figure with the width of the page. The unit of `height` is inches."""
    figure = Figure(figsize=(WIDTH, height), constrained_layout=True)
    FigureCanvasAgg(figure)
    return figure


def legend_below(figure: Figure, handles: Sequence[Any], labels: Sequence[str]) -> None:
    figure.legend(handles, labels, loc='upper center', ncol=3, fontsize=8, frameon=False,
                  bbox_to_anchor=(0.5, 0.0))


def turns_figure(run: RunData) -> Figure:
    """Returns a figure of the remaining angle and the rate of each turn. The angle and the rate are
    positive in the requested direction. The run must have a turn."""
    reports = turn_reports(run)
    figure = new_figure(4.3)
    angle_axes, rate_axes = figure.subplots(2, 1, sharex=True)
    next_begins = [turn.begin for turn in reports[1:]] + [math.inf]
    for index, (turn, next_begin) in enumerate(zip(reports, next_begins)):
        begin = turn.begin - SHOWN_TIME_BEFORE
        end = min(turn.end + SHOWN_TIME_AFTER, next_begin)
        sign = math.copysign(1.0, turn.requested)
        imu = run.imu.between(begin, end)
        yaw = np.unwrap(imu.yaw)
        remaining = abs(turn.requested) - sign * (yaw - np.interp(turn.begin, imu.time, yaw))
        colour, style = STYLES[index % len(STYLES)]
        line_style: Dict[str, Any] = dict(color=colour, linestyle=style, linewidth=1.1)
        name = f'{index + 1}: {math.degrees(turn.requested):+.0f} deg'
        angle_axes.plot(imu.time - turn.begin, np.degrees(remaining), label=name, **line_style)
        rate_axes.plot(imu.time - turn.begin, sign * imu.yaw_rate, **line_style)
        commands = run.commands.between(begin, end)
        rate_axes.plot(commands.time - turn.begin, sign * commands.angular, '.', color=ORANGE,
                       markersize=2.5, label=None if index else 'commanded')

    angle_axes.axhline(0.0, color=GREY, linewidth=0.8)
    angle_axes.set_ylabel('angle left [deg]')
    rate_axes.set(ylabel='rate of turn [rad/s]\n(gyro)', xlabel='time since the first command [s]')
    for axes in (angle_axes, rate_axes):
        axes.grid(True, linewidth=0.3)
    handles, names = angle_axes.get_legend_handles_labels()
    more_handles, more_names = rate_axes.get_legend_handles_labels()
    legend_below(figure, handles + more_handles, names + more_names)
    return figure


def paths_figure(run: RunData, drives: Sequence[DriveReport]) -> Figure:
    """Returns a figure with two panels: the path in odom, and the path in local. Both panels show
    the axes of both frames, and the goals of the drives. The axes of a panel's own frame are black.
    After each reset, the path and the axes of the other frame have a new colour."""
    figure = new_figure(4.0)
    odom_panel, local_panel = figure.subplots(1, 2)
    frames = frame_intervals(run)
    for index, interval in enumerate(frames):
        # after the last colour the first colour follows again, with another line style
        repetition, colour_index = divmod(index, len(STYLES))
        colour, _ = STYLES[colour_index]
        _, style = STYLES[(colour_index + repetition) % len(STYLES)]
        name = f'path after reset {index}' if index else 'path'
        path_style = dict(color=colour, linestyle=style, linewidth=1.6, label=name)
        draw_path(odom_panel, run.odometry.between(interval.begin, interval.end), **path_style)
        draw_path(local_panel, run.local_pose.between(interval.begin, interval.end), **path_style)
        _draw_axes(odom_panel, interval.odom_T_local, colour)
        _draw_axes(local_panel, interval.odom_T_local.inverse(), colour)
        if interval.local_T_world is not None:
            truth = true_poses(run, interval)
            truth_style = dict(color='#bbbbbb', linewidth=4.5, zorder=1,
                               label=None if index else 'ground truth')
            draw_path(local_panel, truth, **truth_style)
            draw_path(odom_panel, local_in_odom(run, truth.time) @ truth, **truth_style)
    goals = []
    goals_in_odom = []
    for drive in drives:
        if drive.goal:
            end = min(drive.end, frame_interval_of(frames, drive.begin, drive.end).end)
            odom_T_local = local_in_odom(run, np.array([end])).pose(0)
            goals.append(drive.goal)
            goals_in_odom.append(odom_T_local @ drive.goal)

    _draw_ends(odom_panel, run.odometry, goals_in_odom)
    _draw_ends(local_panel, run.local_pose, goals)
    for panel, title in ((odom_panel, 'global frame odom (black axes)'),
                         (local_panel, 'local frame (black axes)')):
        _draw_axes(panel, Pose2(), 'black')
        panel.set(title=title, xlabel='x [m]', ylabel='y [m]')
        panel.set_aspect('equal', adjustable='datalim')
        panel.grid(True, linewidth=0.3)
    legend_below(figure, *odom_panel.get_legend_handles_labels())
    return figure


def draw_path(panel: Axes, poses: Poses, **style: Any) -> None:
    """Draw a line through the poses. The line has a gap where the poses leap."""
    panel.plot(np.insert(poses.x, poses.leap_indices, np.nan),
               np.insert(poses.y, poses.leap_indices, np.nan), **style)


def _draw_axes(panel: Axes, frame: Pose2, colour: str) -> None:
    for tip in ((0.2, 0.0), (0.0, 0.13)):       # of the x axis and the y axis [m]
        begin, end = frame.act([(0.0, 0.0), tip])
        panel.annotate('', end, begin, arrowprops=dict(
            arrowstyle='-|>', color=colour, shrinkA=0, shrinkB=0, linewidth=1.4))
    panel.update_datalim(frame.act([(-0.5, 0.0), (0.5, 0.0), (0.0, 0.5)]))


def _draw_ends(panel: Axes, poses: Poses, goals: Sequence[Pose2]) -> None:
    panel.plot(poses.x[:1], poses.y[:1], 'o', color='black', markersize=6, zorder=5, label='start')
    panel.plot(poses.x[-1:], poses.y[-1:], 's', color='black', markersize=4, zorder=5, label='end')
    for index, goal in enumerate(goals):
        panel.plot(goal.x, goal.y, '*', markerfacecolor='none', markeredgecolor='black',
                   markersize=13, linestyle='', zorder=6, label=None if index else 'goal')
