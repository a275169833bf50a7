"""The figures of a run, each drawn from a RunData into a matplotlib Figure.

Readable in black and white: lines differ by style and width, states by hatching.

Units on the axes: metres, degrees, seconds since the recording's start, m/s, rad/s.
"""
import math
from typing import List, Optional, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from tb3_labs.report import analysis
from tb3_labs.report.completed import RESTED
from tb3_labs.report.epochs import epochs
from tb3_labs.report.figures import BLUE, GREY, ORANGE, curve, legend_below, new_figure
from tb3_labs.report.run_data import RunData
from tb3_labs.report.sensors import yaw_offset
from tb3_labs.robot.turtlebot3 import RobotModel

#: state: (fill, hatching); '' stands for all other states (waiting, stopped, gave up).
STATES = {'ROTATE_TO_GOAL': ('#c9d8ee', '///'), 'MOVE_FORWARD': ('#f7e3c4', ''),
          'ROTATE_TO_FINAL': ('#d3e8d3', '\\\\\\'), 'GOAL_REACHED': ('#ffffff', ''),
          RESTED: ('#ffffff', ''),
          '': ('#dddddd', '...')}
#: Most labels in a figure: more would cover each other.
MOST_LABELS = 6


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
