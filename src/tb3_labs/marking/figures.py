"""Figures of what the robot did while a node was tried out.

Units on the axes: metres, degrees, seconds since the observation began, m/s, rad/s.
"""
import io

from typing import Optional

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.criteria import ANGULAR, LINEAR
from tb3_labs.marking.move2goal import GOAL_POSE, LOCAL_T_WORLD
from tb3_labs.marking.observation import Observation
from tb3_labs.report.figures import (
    BLUE, GREEN, GREY, ORANGE, curve, map_of_local, new_figure, save)

#: Distance between the labels of two stimuli, and the place of the last one, as parts of the axes'
#: width.
LABEL_WIDTH, LAST_LABEL = 0.03, 1.05
#: Most lines of the heading's axis.
MOST_LINES = 6


def png(figure: Figure) -> bytes:
    """The figure as a PNG file."""
    data = io.BytesIO()
    save(figure, data)
    return data.getvalue()


def over_time(observation: Observation) -> Figure:
    """True heading and the node's commands over time; each stimulus is a shaded stretch."""
    figure = new_figure(5.4)
    heading, angular, linear = plots = figure.subplots(3, 1, sharex=True)
    truth = np.array(observation.truth, dtype=float).reshape(-1, 4)
    commands = np.array(observation.commands, dtype=float).reshape(-1, 3)
    if len(truth):
        curve(heading, truth[:, 0], np.degrees(truth[:, 3]), color=BLUE)
    for axes, column in ((angular, ANGULAR), (linear, LINEAR)):
        if len(commands):
            axes.plot(commands[:, 0], commands[:, column], '.', markersize=2.0, color=ORANGE)
        axes.margins(y=0.1)
    for axes, label in zip(plots, ('heading [deg]', 'commanded\n[rad/s]', 'commanded\n[m/s]')):
        axes.set_ylabel(label)
        axes.grid(True, linewidth=0.3)
        for stimulus in observation.stimuli:
            axes.axvspan(stimulus.begin, stimulus.end, color='#e6e6e6', linewidth=0.0, zorder=0)
        for run in observation.runs:
            axes.axvline(run.begin, color=GREY, linewidth=0.8, linestyle=':')
    end = max([1.0] + [row[0] for row in observation.truth[-1:]])
    _label_stimuli(heading, observation.stimuli, end)
    quarters = np.ptp(heading.get_ylim()) / 90.0
    heading.yaxis.set_major_locator(MultipleLocator(90.0 * np.ceil(quarters / MOST_LINES)))
    linear.set_xlim(0.0, end)
    linear.set_xlabel('time [s]; dotted: the node was started')
    return figure


def _label_stimuli(axes, stimuli, end):
    """Write the names above the axes, no two of them over each other."""
    place = -1.0
    for left, stimulus in zip(range(len(stimuli) - 1, -1, -1), stimuli):
        place = max(stimulus.begin / end, place + LABEL_WIDTH)
        place = min(place, LAST_LABEL - left * LABEL_WIDTH)
        axes.annotate(stimulus.name, (stimulus.begin / end, 1.0), (place, 1.08), rotation=60,
                      fontsize=7, xycoords='axes fraction', ha='left', va='bottom',
                      arrowprops=dict(arrowstyle='-', linewidth=0.4, color=GREY,
                                      relpos=(0.0, 0.0)))


def path(observation: Observation) -> Optional[Figure]:
    """The robot's true way in the local frame of each drive; None if there was no drive."""
    drives = [stimulus for stimulus in observation.stimuli if GOAL_POSE in stimulus.facts]
    if not drives:
        return None
    figure = new_figure(3.6)
    axes = figure.subplots(1, 1)
    truth = np.array(observation.truth, dtype=float).reshape(-1, 4)
    for drive, (colour, style) in zip(drives, ((BLUE, '-'), (ORANGE, '--'), (GREEN, '-.'),
                                               ('#7a3a8a', ':'))):
        local_T_world = Pose2(*drive.facts[LOCAL_T_WORLD])
        rows = truth[(truth[:, 0] >= drive.begin) & (truth[:, 0] <= drive.end)]
        if len(rows):
            way = local_T_world.act(rows[:, 1:3])
            axes.plot(way[:, 0], way[:, 1], color=colour, linestyle=style, label=drive.name)
            facing = local_T_world.yaw + rows[-1, 3]
            axes.annotate('', way[-1] + 0.12 * np.array([np.cos(facing), np.sin(facing)]), way[-1],
                          arrowprops=dict(arrowstyle='-|>', color=colour))
        axes.plot(*drive.facts[GOAL_POSE][:2], '*', markerfacecolor='none', markeredgecolor='black',
                  markersize=13)
    axes.plot(0.0, 0.0, 'o', color='black', markersize=5)
    map_of_local(figure, axes, 0.15)
    return figure
