"""The figure of a run's turns, laid over each other from their first commands on.

Units on the axes: seconds, degrees, rad/s.
"""
import math
from typing import Any, Dict, Optional

import numpy as np
from matplotlib.figure import Figure

from tb3_labs.report.epochs import between
from tb3_labs.report.figures import GREY, ORANGE, STYLES, curve, legend_below, new_figure
from tb3_labs.report.run_data import RunData
from tb3_labs.report.turns import REST_MEAN, turns as turns_of
from tb3_labs.robot.turtlebot3 import RobotModel

#: A turn is drawn from this time before it until this time after it [s].
BEFORE, AFTER = 0.2, 2.0 * REST_MEAN
#: Up to this many turns have names in the legend.
MOST_NAMES = 12


def turns(run: RunData, _model: RobotModel) -> Optional[Figure]:
    """The angle left, and the rate of turn, both in the direction that was asked for; None without
    a turn."""
    found = turns_of(run)
    if not found:
        return None
    figure = new_figure(4.3)
    left, rate = figure.subplots(2, 1, sharex=True)
    ends = [turn.begin for turn in found[1:]] + [math.inf]
    for number, (turn, following) in enumerate(zip(found, ends)):
        until = min(turn.end + AFTER, following)
        sign = math.copysign(1.0, turn.asked)
        imu = between(run.imu, turn.begin - BEFORE, until)
        yaw = np.unwrap(imu.yaw)
        remaining = abs(turn.asked) - sign * (yaw - np.interp(turn.begin, imu.time, yaw))
        colour, style = STYLES[number % len(STYLES)]
        looks: Dict[str, Any] = dict(color=colour, linestyle=style, linewidth=1.1)
        name = '{}: {:+.0f} deg'.format(number + 1, math.degrees(turn.asked))
        curve(left, imu.time - turn.begin, np.degrees(remaining),
              label=name if number < MOST_NAMES else None, **looks)
        curve(rate, imu.time - turn.begin, sign * imu.yaw_rate, **looks)
        commands = between(run.commands, turn.begin - BEFORE, until)
        rate.plot(commands.time - turn.begin, sign * commands.angular, '.', color=ORANGE,
                  markersize=2.5, label=None if number else 'commanded')
    left.axhline(0.0, color=GREY, linewidth=0.8)
    left.set_ylabel('angle left [deg]')
    rate.set_ylabel('rate of turn [rad/s]\n(gyro)')
    rate.set_xlabel('time since the first command [s]')
    rate.legend(fontsize=8, frameon=False)
    for axes in (left, rate):
        axes.grid(True, linewidth=0.3)
    legend_below(figure, left)
    return figure
