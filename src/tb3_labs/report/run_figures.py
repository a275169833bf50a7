"""The figures of a run, each drawn from a RunData into a matplotlib Figure.

Readable in black and white: lines differ by style and width, states by hatching.

Units on the axes: metres, degrees, seconds since the recording's start, m/s, rad/s.
"""
import math
from typing import Any, List, Optional, Sequence, Tuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.report import analysis
from tb3_labs.report.analysis import DriveReport
from tb3_labs.report.epochs import Epoch, between, epoch_of, epochs, local_in_odom
from tb3_labs.report.figures import (
    BLUE, GREEN, GREY, ORANGE, curve, legend_below, new_figure, thin)
from tb3_labs.report.run_data import Poses, RunData
from tb3_labs.report.sensors import yaw_offset
from tb3_labs.robot.turtlebot3 import RobotModel

#: Line styles of the paths of successive epochs.
EPOCH_STYLES = ((BLUE, '-'), (ORANGE, '--'), (GREEN, '-.'), ('#7a3a8a', ':'))
#: state: (fill, hatching); '' stands for all other states (waiting, stopped, gave up).
STATES = {'ROTATE_TO_GOAL': ('#c9d8ee', '///'), 'MOVE_FORWARD': ('#f7e3c4', ''),
          'ROTATE_TO_FINAL': ('#d3e8d3', '\\\\\\'), 'GOAL_REACHED': ('#ffffff', ''),
          '': ('#dddddd', '...')}
#: Most labels in a figure: more would cover each other.
MOST_LABELS = 6
#: A jump in a path by more than this is left blank [m].
LEAP = 0.3


def paths(run: RunData, model: RobotModel) -> Figure:
    """The path in odom and in local, side by side at one scale, with the axes of both frames."""
    figure = new_figure(4.0)
    in_odom, in_local = figure.subplots(1, 2)
    frames, local = epochs(run), analysis.local_poses(run)
    for number, epoch in enumerate(frames):
        colour, style = EPOCH_STYLES[number % len(EPOCH_STYLES)]
        label = 'path after reset {}'.format(number) if number else 'path'
        looks = dict(color=colour, linestyle=style, linewidth=1.6,
                     label=label if number < len(EPOCH_STYLES) else None)
        _path(in_odom, between(run.odometry, epoch.begin, epoch.end), **looks)
        _path(in_local, between(local, epoch.begin, epoch.end), **looks)
        if epoch.local_T_world is not None:
            truth = between(run.ground_truth, epoch.begin, epoch.end).seen_from(
                epoch.local_T_world)
            looks = dict(color='#bbbbbb', linewidth=4.5, zorder=1,
                         label=None if number else 'ground truth')
            _path(in_local, truth, **looks)
            _path(in_odom, local_in_odom(run, truth.time) @ truth, **looks)
    goals = [(drive, drive.goal) for drive in analysis.drives(run, model) if drive.goal]
    _ends(in_odom, run.odometry, [_in_odom(run, frames, *pair) for pair in goals])
    _ends(in_local, local, [goal for _, goal in goals])
    size = _same_scale((in_odom, [epoch.odom_T_local for epoch in frames]),
                       (in_local, [epoch.odom_T_local.inverse() for epoch in frames]))
    for number, epoch in enumerate(frames[:len(EPOCH_STYLES)]):
        after = ', reset {}'.format(number) if number else ''
        _axes_of(in_odom, epoch.odom_T_local, 'local' + after, size)
        _axes_of(in_local, epoch.odom_T_local.inverse(), 'odom' + after, size)
    for axes, frame, title in ((in_odom, 'odom', 'global frame (odom)'),
                               (in_local, 'local', 'local frame')):
        _axes_of(axes, Pose2(), frame, size, own=True)
        axes.set_title(title)
        axes.set_xlabel('x [m]')
        axes.set_ylabel('y [m]')
        axes.grid(True, linewidth=0.3)
    legend_below(figure, in_odom)
    return figure


def errors(run: RunData, model: RobotModel) -> Optional[Figure]:
    """Distance and angle to the goal over time; None without a goal."""
    time, distance, angle = analysis.goal_errors(run)
    if not len(time):
        return None
    figure = new_figure(4.3)
    far, turned = figure.subplots(2, 1, sharex=True)
    curve(far, time, distance, _resets(run), color=BLUE)
    curve(turned, time, np.degrees(angle), _resets(run), circle=True, color=BLUE)
    far.set_ylabel('distance error [m]')
    far.set_ylim(bottom=0.0)
    _degrees_axis(turned, 'angle error [deg]')
    drives = analysis.drives(run, model)
    for drive in drives if len(drives) <= MOST_LABELS else ():
        if not math.isnan(drive.measured[0]):
            far.annotate(
                '{:.1f} mm\n{:.1f} deg'.format(1000.0 * drive.measured[0],
                                               abs(math.degrees(drive.measured[1]))),
                (drive.end, drive.measured[0]), xytext=(-6, 16), textcoords='offset points',
                ha='right', fontsize=8, bbox=dict(boxstyle='round,pad=0.2', facecolor='white',
                                                  linewidth=0.5),
                arrowprops=dict(arrowstyle='-', linewidth=0.8))
    _shade(figure, (far, turned), run)
    return figure


def heading(run: RunData, _model: RobotModel) -> Figure:
    """The IMU's heading, wrapped and continuous, and its difference from the odometry's."""
    figure = new_figure(5.0)
    circle, line, apart = figure.subplots(3, 1, sharex=True)
    curve(circle, run.imu.time, np.degrees(run.imu.yaw), circle=True, color=BLUE)
    curve(line, run.imu.time, np.degrees(np.unwrap(run.imu.yaw)), color=BLUE)
    offset = yaw_offset(run)
    curve(apart, offset.time, np.degrees(offset.deviation), color=GREY, linewidth=0.8)
    _degrees_axis(circle, 'IMU, wrapped\n[deg]')
    line.set_ylabel('IMU, continuous\n[deg]')
    apart.set_ylabel('IMU - odometry\nminus mean [deg]')
    apart.set_title('IMU minus odometry: mean {:+.2f} deg'.format(math.degrees(offset.mean)),
                    fontsize=9)
    most = max([0.25] + list(1.1 * np.abs(np.degrees(offset.deviation))))
    apart.set_ylim(-most, most)
    _finish_time(run, circle, line, apart)
    return figure


def speeds(run: RunData, model: RobotModel) -> Figure:
    """Commanded against measured speeds, with the robot's limits."""
    figure = new_figure(4.3)
    linear, angular = figure.subplots(2, 1, sharex=True)
    curve(linear, run.odometry.time, run.odometry.linear, color=BLUE, label='measured')
    curve(angular, run.imu.time, run.imu.yaw_rate, color=BLUE, label='measured')
    for axes, commands, limit in ((linear, run.commands.linear, model.max_linear),
                                  (angular, run.commands.angular, model.max_angular)):
        if len(commands):
            curve(axes, run.commands.time, commands, color=ORANGE, linestyle='--', linewidth=1.1,
                  drawstyle='steps-post', label='commanded')
        for sign in (1.0, -1.0):
            axes.axhline(sign * limit, color='black', linewidth=0.8, linestyle=':',
                         label='limit of the {}'.format(model.name) if sign > 0.0 else None)
        axes.margins(y=0.1)
    linear.set_ylabel('linear [m/s]\n(odometry)')
    angular.set_ylabel('angular [rad/s]\n(gyro)')
    _finish_time(run, linear, angular)
    legend_below(figure, linear)
    return figure


def _path(axes: Axes, poses: Poses, **looks: Any) -> None:
    """A line with blanks where the poses jump, as at a reset of the odometry."""
    leaps = np.flatnonzero(np.hypot(np.diff(poses.x), np.diff(poses.y)) > LEAP) + 1
    for piece in np.split(np.arange(len(poses)), leaps):
        if len(piece):
            kept = piece[thin(poses.x[piece], poses.y[piece])]
            axes.plot(poses.x[kept], poses.y[kept], **looks)
            looks['label'] = None


def _in_odom(run: RunData, frames: Sequence[Epoch], drive: DriveReport, goal: Pose2) -> Pose2:
    last = min(drive.end, epoch_of(frames, drive.begin, drive.end).end)
    return local_in_odom(run, np.array([last])).pose(0) @ goal


def _same_scale(*panels: Tuple[Axes, Sequence[Pose2]]) -> float:
    """Give the panels (axes, frames) axes of one scale and size that hold all; their width [m]."""
    boxes = []
    for axes, frames in panels:
        places = [(frame.x, frame.y) for frame in frames[:len(EPOCH_STYLES)]] + [(0.0, 0.0)]
        axes.update_datalim(places)
        boxes.append(axes.dataLim.get_points())
    width = max([1.0] + [1.35 * np.ptp(box, axis=0).max() for box in boxes])
    for (axes, _), box in zip(panels, boxes):
        x, y = box.mean(axis=0)
        axes.set_xlim(x - width / 2.0, x + width / 2.0)
        axes.set_ylim(y - width / 2.0, y + width / 2.0)
        axes.set_aspect('equal', adjustable='box')
    return width


def _axes_of(axes: Axes, pose: Pose2, name: str, width: float, own: bool = False) -> None:
    """A frame's x axis (long) and y axis (short) with its name; `own`: the panel's own frame."""
    for tip in ((0.13 * width, 0.0), (0.0, 0.08 * width)):
        begin, end = pose.act([(0.0, 0.0), tip])
        axes.annotate('', end, begin, arrowprops=dict(
            arrowstyle='-|>', color='black' if own else GREY, shrinkA=0, shrinkB=0,
            linewidth=1.8 if own else 1.0))
    away = pose.yaw + 1.25 * math.pi      # between the backs of both axes
    right, up = math.cos(away), math.sin(away)
    axes.annotate(name, (pose.x, pose.y), xytext=(9.0 * right, 9.0 * up), fontsize=8,
                  textcoords='offset points', fontweight='bold' if own else 'normal',
                  ha='center' if abs(right) < 0.4 else 'left' if right > 0.0 else 'right',
                  va='center' if abs(up) < 0.4 else 'bottom' if up > 0.0 else 'top')


def _ends(axes: Axes, poses: Poses, goals: Sequence[Pose2]) -> None:
    axes.plot(poses.x[:1], poses.y[:1], 'o', color='black', markersize=6, zorder=5, label='start')
    axes.plot(poses.x[-1:], poses.y[-1:], 's', color='black', markersize=4, zorder=5, label='end')
    for number, goal in enumerate(goals):
        axes.plot(goal.x, goal.y, '*', markerfacecolor='none', markeredgecolor='black',
                  markersize=13, linestyle='', zorder=6, label=None if number else 'goal')


def _shade(figure: Figure, plots: Sequence[Axes], run: RunData) -> None:
    """Draw states as shades and resets as lines, with a legend for both."""
    used = {}
    for span in analysis.spans(run):
        kind = span.state if span.state in STATES else ''
        fill, hatch = STATES[kind]
        used[kind] = Patch(facecolor=fill, hatch=hatch, edgecolor='#aaaaaa',
                           label=kind or 'waiting, stopped or gave up')
        for axes in plots:
            axes.axvspan(max(0.0, span.begin), span.end, facecolor=fill, hatch=hatch,
                         edgecolor='#bbbbbb', linewidth=0.0, zorder=0)
    _finish_time(run, *plots)
    lines = [line for line in plots[0].get_lines() if line.get_label() == 'reset']
    figure.legend(handles=list(used.values()) + lines, loc='upper center', ncol=6, fontsize=8,
                  frameon=False, bbox_to_anchor=(0.5, 0.0), handlelength=2.5)


def _resets(run: RunData) -> List[float]:
    return [epoch.begin for epoch in epochs(run)[1:]]


def _finish_time(run: RunData, *plots: Axes) -> None:
    for axes in plots:
        for number, reset in enumerate(_resets(run)):
            axes.axvline(reset, color='black', linewidth=1.4, linestyle=(0, (4, 2)),
                         label=None if number else 'reset')
        axes.grid(True, linewidth=0.3)
        axes.set_xlim(0.0, run.duration)
    plots[-1].set_xlabel('time [s]')


def _degrees_axis(axes: Axes, label: str) -> None:
    axes.set_ylabel(label)
    axes.set_ylim(-190.0, 190.0)
    axes.set_yticks([-180, -90, 0, 90, 180])
