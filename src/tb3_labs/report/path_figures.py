"""The paths of a run in the global and in the local frame, and the drives of several runs.

Units on the axes: metres.
"""
from typing import Any, Optional, Sequence, Tuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.report.drives import DriveReport, drives
from tb3_labs.report.epochs import Epoch, epoch_of, epochs, local_in_odom
from tb3_labs.report.figures import GREY, STYLES, legend_below, new_figure
from tb3_labs.report.run_data import Poses, RunData
from tb3_labs.robot.turtlebot3 import RobotModel

#: The names of frames are LINE apart [points] if the origins are nearer than NEAR, as a part of a
#: panel's width.
LINE, NEAR = 11.0, 0.25


def paths(run: RunData, model: RobotModel) -> Figure:
    """The path in odom and in local, side by side at one scale, with the axes of both frames."""
    figure = new_figure(4.0)
    in_odom, in_local = figure.subplots(1, 2)
    frames, local = epochs(run), run.local_pose
    for number, epoch in enumerate(frames):
        colour, _ = STYLES[number % len(STYLES)]
        _, style = STYLES[(number + number // len(STYLES)) % len(STYLES)]
        looks = dict(color=colour, linestyle=style, linewidth=1.6,
                     label='path after reset {}'.format(number) if number else 'path')
        draw_path(in_odom, run.odometry.between(epoch.begin, epoch.end), **looks)
        draw_path(in_local, local.between(epoch.begin, epoch.end), **looks)
        if epoch.local_T_world is not None:
            truth = run.ground_truth.between(epoch.begin, epoch.end).seen_from(
                epoch.local_T_world)
            looks = dict(color='#bbbbbb', linewidth=4.5, zorder=1,
                         label=None if number else 'ground truth')
            draw_path(in_local, truth, **looks)
            draw_path(in_odom, local_in_odom(run, truth.time) @ truth, **looks)
    goals = [(drive, drive.goal) for drive in drives(run, model) if drive.goal]
    _ends(in_odom, run.odometry, [_in_odom(run, frames, *pair) for pair in goals])
    _ends(in_local, local, [goal for _, goal in goals])
    size = _same_scale((in_odom, [epoch.odom_T_local for epoch in frames]),
                       (in_local, [epoch.odom_T_local.inverse() for epoch in frames]))
    shown = [(epoch.odom_T_local, ', reset {}'.format(number) if number else '')
             for number, epoch in enumerate(frames)]
    _frames(in_odom, 'odom', [(pose, 'local' + after) for pose, after in shown], size)
    _frames(in_local, 'local', [(pose.inverse(), 'odom' + after) for pose, after in shown], size)
    for axes, title in ((in_odom, 'global frame (odom)'), (in_local, 'local frame')):
        axes.set(title=title, xlabel='x [m]', ylabel='y [m]')
        axes.grid(True, linewidth=0.3)
    legend_below(figure, *in_odom.get_legend_handles_labels())
    return figure


def ways(runs: Sequence[Any]) -> Optional[Figure]:
    """All drives in the local frame, with their goals; None without drives."""
    if not any(run.drives for run in runs):
        return None
    figure = new_figure(4.6)
    axes = figure.subplots()
    for number, run in enumerate(runs):
        colour, style = STYLES[number % len(STYLES)]
        label = run.name
        for way in run.ways:
            draw_path(axes, way, color=colour, linestyle=style, linewidth=1.2, label=label)
            axes.plot(way.x[-1:], way.y[-1:], 's', color=colour, markersize=4)
            label = None
    goals = sorted({(drive.goal.x, drive.goal.y) for run in runs for drive in run.drives
                    if drive.goal})
    for number, (x, y) in enumerate(goals):
        axes.plot(x, y, '*', markerfacecolor='none', markeredgecolor='black', markersize=13,
                  linestyle='', label=None if number else 'goal')
    axes.plot(0.0, 0.0, 'o', color='black', markersize=5, linestyle='', label='origin of local')
    axes.set_aspect('equal', adjustable='datalim')
    axes.margins(0.1)
    axes.set(xlabel='x in local [m]', ylabel='y in local [m]')
    axes.grid(True, linewidth=0.3)
    legend_below(figure, *axes.get_legend_handles_labels())
    return figure


def draw_path(axes: Axes, poses: Poses, **looks: Any) -> None:
    """Draw a line with blanks at jumps of the poses, such as a reset of the odometry."""
    for piece in np.split(np.arange(len(poses)), poses.leaps):
        if len(piece):
            axes.plot(poses.x[piece], poses.y[piece], **looks)
            looks['label'] = None


def _in_odom(run: RunData, frames: Sequence[Epoch], drive: DriveReport, goal: Pose2) -> Pose2:
    last = min(drive.end, epoch_of(frames, drive.begin, drive.end).end)
    return local_in_odom(run, np.array([last])).pose(0) @ goal


def _same_scale(*panels: Tuple[Axes, Sequence[Pose2]]) -> float:
    """Give all panels (axes, frames) the same scale and size. Returns the width of a panel [m]."""
    boxes = []
    for axes, frames in panels:
        places = [(frame.x, frame.y) for frame in frames] + [(0.0, 0.0)]
        axes.update_datalim(places)
        boxes.append(axes.dataLim.get_points())
    width = max([1.0] + [1.35 * np.ptp(box, axis=0).max() for box in boxes])
    for (axes, _), box in zip(panels, boxes):
        x, y = box.mean(axis=0)
        axes.set(xlim=(x - width / 2.0, x + width / 2.0), ylim=(y - width / 2.0, y + width / 2.0))
        axes.set_aspect('equal', adjustable='box')
    return width


def _frames(axes: Axes, own: str, others: Sequence[Tuple[Pose2, str]], width: float) -> None:
    """Draw the panel's `own` frame and `others`, (pose, name): x axes (long), y axes, names. A name
    stands below its origin, one line lower for each earlier frame that is near."""
    named = [(Pose2(), own)] + list(others)
    for number, (pose, name) in enumerate(named):
        for tip in ((0.13 * width, 0.0), (0.0, 0.08 * width)):
            begin, end = pose.act([(0.0, 0.0), tip])
            axes.annotate('', end, begin, arrowprops=dict(
                arrowstyle='-|>', color=GREY if number else 'black', shrinkA=0, shrinkB=0,
                linewidth=1.0 if number else 1.8))
        near = sum(pose.distance_to(other) < NEAR * width for other, _ in named[:number])
        axes.annotate(name, (pose.x, pose.y), xytext=(0.0, -LINE * (near + 0.4)), fontsize=8,
                      textcoords='offset points', fontweight='normal' if number else 'bold',
                      ha='center', va='top',
                      bbox=dict(facecolor='white', alpha=0.7, linewidth=0.0, pad=0.0))


def _ends(axes: Axes, poses: Poses, goals: Sequence[Pose2]) -> None:
    axes.plot(poses.x[:1], poses.y[:1], 'o', color='black', markersize=6, zorder=5, label='start')
    axes.plot(poses.x[-1:], poses.y[-1:], 's', color='black', markersize=4, zorder=5, label='end')
    for number, goal in enumerate(goals):
        axes.plot(goal.x, goal.y, '*', markerfacecolor='none', markeredgecolor='black',
                  markersize=13, linestyle='', zorder=6, label=None if number else 'goal')
