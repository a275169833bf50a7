#!/usr/bin/env python3
"""Draws the figures of the lab sheets: doc/figures/*.svg.

    python3 doc/instructor/make_figures.py

The two frames have the numbers of the worked example in the sheets.
`test/unit/test_worked_examples.py` computes these numbers in another way.

Units: metres, degrees on labels; radians inside.
"""
import math
import pathlib

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle

from tb3_labs.control.goal_state import DRIVING
from tb3_labs.geometry.angles import difference, difference_degrees
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.handout import (
    ANGLE_TOLERANCE, DISTANCE_TOLERANCE, DRIVE_SPEED, GAIN_TO_FINAL, GAIN_TO_GOAL, HDG_TOL, K_HDG,
    MAX_ANG_Z, MIN_ANG_Z, TURN_DEG)
from tb3_labs.report.motion.movements import LAB_GOAL
from tb3_labs.report.page.figures import BLUE, GREEN, GREY, ORANGE

ROOT = pathlib.Path(__file__).resolve().parents[2]
DOC = ROOT / 'doc'
#: The worked example's pose of B in A. The angle has the cosine 0.6 and the sine 0.8.
A_T_B = Pose2(2.0, 1.0, math.atan2(0.8, 0.6))
#: The worked example's pose of the robot in A.
A_T_ROBOT = Pose2(1.0, 3.0, A_T_B.yaw + math.pi / 2.0)
#: The yaw of the IMU minus the yaw of the odometry, of a real Burger [deg].
OFFSET_DEG = -34.6
#: The time between two commands of the lab's law [s].
COMMAND_PERIOD = 0.1
#: The figures of turns show this time [s].
TURN_DURATION = 8.0
#: state -> (fill, hatching)
STATES = {'ROTATE_TO_GOAL': ('#c9d8ee', '///'), 'MOVE_FORWARD': ('#f7e3c4', ''),
          'ROTATE_TO_FINAL': ('#d3e8d3', '\\\\\\'), 'GOAL_REACHED': ('#ffffff', '')}


def blank(axes, x, y):
    """Give the axes equal scales, and hide them."""
    axes.axis('off')
    axes.set(aspect='equal', xlim=x, ylim=y)


def plain(axes, x, y):
    """Give the axes equal scales, a faint grid, and names."""
    axes.set(aspect='equal', xlim=x, ylim=y, axisbelow=True, xlabel='x [m]', ylabel='y [m]')
    axes.grid(color='#e4e4e4', linewidth=0.6)


def arrow(axes, begin, end, colour, **looks):
    """Draw an arrow between two places."""
    axes.annotate('', end, begin, arrowprops=dict(
        arrowstyle='-|>', color=colour, shrinkA=0, shrinkB=0, **dict(dict(linewidth=1.8), **looks)))


def label(axes, place, text, colour, size=11, **looks):
    """Write a text, centred at a place."""
    axes.text(*place, text, color=colour, fontsize=size, ha='center', va='center', **looks)


def frame(axes, pose, name, colour, lengths, where=(-0.16, -0.22), gap=0.17):
    """Draw the axes x and y of a frame, of two `lengths`. The name stands at `where` from the
    origin of the frame."""
    for direction, letter, length in (((1.0, 0.0), 'x', lengths[0]), ((0.0, 1.0), 'y', lengths[1])):
        arrow(axes, (pose.x, pose.y), pose.act(np.multiply(direction, length)), colour)
        tip = pose.act(np.multiply(direction, length + gap))
        label(axes, tip, f'{letter}$_{{{name}}}$', colour)
    label(axes, (pose.x + where[0], pose.y + where[1]), name, colour, 13, fontweight='bold')


def angle(axes, pose, begin_deg, end_deg, radius, text, colour):
    """Draw an arc with a label round the place of a pose, from one direction to another."""
    axes.add_patch(Arc((pose.x, pose.y), 2 * radius, 2 * radius, theta1=begin_deg, theta2=end_deg,
                       color=colour, linewidth=1.4))
    middle = math.radians((begin_deg + end_deg) / 2.0)
    label(axes, (pose.x + 1.35 * radius * math.cos(middle),
                 pose.y + 1.35 * radius * math.sin(middle)), text, colour)


def robot(axes, pose, size=0.16):
    """Draw a robot as a disc with a line in its heading."""
    axes.add_patch(Circle((pose.x, pose.y), size, facecolor='white', edgecolor=GREY,
                          linewidth=1.6, zorder=4))
    axes.plot(*zip((pose.x, pose.y), pose.act((1.7 * size, 0.0))), color=GREY, linewidth=2.2,
              zorder=5)


def mark_goal(axes):
    """Draw the lab's goal, and the circle within which the lab's own law stops."""
    axes.add_patch(Circle((LAB_GOAL.x, LAB_GOAL.y), DISTANCE_TOLERANCE, fill=False, linestyle='--',
                          color=GREEN))
    axes.plot(LAB_GOAL.x, LAB_GOAL.y, '*', color=GREEN, markersize=13, zorder=6)


def dotted(axes, *places, colour):
    """Draw a thin dotted line through places."""
    axes.plot(*zip(*places), color=colour, linewidth=1.2, linestyle=(0, (2, 2)))


def point_in_both_frames():
    """A place, with the place's coordinates in A and in B."""
    figure = Figure((5.6, 4.4), constrained_layout=True)
    axes = figure.subplots()
    plain(axes, (-0.5, 4.2), (-0.45, 3.8))
    place = (A_T_ROBOT.x, A_T_ROBOT.y)
    p_B = A_T_B.inverse().act(place)
    frame(axes, Pose2(), 'A', BLUE, (3.7, 3.3))
    frame(axes, A_T_B, 'B', ORANGE, (1.5, 2.15), where=(0.24, -0.14))
    dotted(axes, (0.0, place[1]), place, (place[0], 0.0), colour=BLUE)
    dotted(axes, A_T_B.act((p_B[0], 0.0)), place, A_T_B.act((0.0, p_B[1])), colour=ORANGE)
    arrow(axes, (0.0, 0.0), (A_T_B.x, A_T_B.y), GREY, linestyle='--')
    axes.text(1.12, 0.36, '$t$ = (2, 1)', color=GREY, fontsize=11)
    dotted(axes, (A_T_B.x, A_T_B.y), (A_T_B.x + 1.0, A_T_B.y), colour=GREY)
    angle(axes, A_T_B, 0.0, math.degrees(A_T_B.yaw), 0.5, r'$\theta$', GREY)
    axes.plot(*place, 'o', color='black', markersize=7, zorder=5)
    axes.text(place[0] + 0.14, place[1] + 0.24, '$p_A$ = ({:g}, {:g})'.format(*place), color=BLUE,
              fontsize=12)
    axes.text(place[0] + 0.14, place[1] + 0.0, '$p_B$ = ({:.0f}, {:.0f})'.format(*p_B),
              color=ORANGE, fontsize=12, va='center')
    return figure


def heading_in_both_frames():
    """A robot, with the robot's heading in A and in B."""
    figure = Figure((4.6, 2.8), constrained_layout=True)
    axes = figure.subplots()
    blank(axes, (-1.7, 2.0), (-0.35, 1.75))
    here, theta = Pose2(0.0, 0.0, A_T_ROBOT.yaw), math.degrees(A_T_B.yaw)
    for direction, colour, name in ((0.0, BLUE, 'x$_A$'), (A_T_B.yaw, ORANGE, 'x$_B$'),
                                    (here.yaw, 'black', 'robot')):
        tip = Pose2(0.0, 0.0, direction).act((1.55, 0.0))
        arrow(axes, (0.0, 0.0), tip, colour)
        label(axes, np.multiply(tip, 1.12), name, colour)
    robot(axes, here, 0.16)
    angle(axes, here, 0.0, theta, 0.8, '', GREY)
    angle(axes, here, theta, math.degrees(here.yaw), 0.8, '', ORANGE)
    angle(axes, here, 0.0, math.degrees(here.yaw), 1.2, '', BLUE)
    label(axes, (0.47, 0.2), r'$\theta$ = 53.1', GREY)
    label(axes, (-0.1, 0.48), r'$\theta_B$ = 90', ORANGE)
    label(axes, (0.05, 1.36), r'$\theta_A$ = 143.1', BLUE)
    return figure


def drive():
    """Returns a drive by the lab's law, of a robot without delays: rows of time [s], pose in local,
    state, linear [m/s], angular [rad/s]."""
    pose, states, seen = Pose2(), list(DRIVING), []
    while states:
        linear = angular = 0.0
        if states[0] == 'MOVE_FORWARD':
            linear, is_over = DRIVE_SPEED, pose.distance_to(LAB_GOAL) <= DISTANCE_TOLERANCE
        else:
            final = states[0] == 'ROTATE_TO_FINAL'
            error = difference(LAB_GOAL.yaw if final else pose.bearing_to(LAB_GOAL), pose.yaw)
            angular = (GAIN_TO_FINAL if final else GAIN_TO_GOAL) * error
            is_over = abs(error) <= ANGLE_TOLERANCE
        if is_over:
            del states[0]
        else:
            pose = pose @ Pose2(linear * COMMAND_PERIOD, 0.0, angular * COMMAND_PERIOD)
            seen.append((len(seen) * COMMAND_PERIOD, pose, states[0], linear, angular))
    return seen


def four_states():
    """A drive in local, and its commands over time, with the states."""
    seen = drive()
    figure = Figure((8.4, 3.8), constrained_layout=True)
    left, right = figure.subplots(1, 2, gridspec_kw=dict(width_ratios=(1, 1.25)))
    plain(left, (-1.0, 0.4), (-0.25, 0.9))
    mark_goal(left)
    left.text(LAB_GOAL.x, LAB_GOAL.y + 0.18, 'goal', color=GREEN, ha='center')
    left.plot([pose.x for _, pose, *_ in seen], [pose.y for _, pose, *_ in seen], color=BLUE)
    for state, look, ha in zip(DRIVING, ((0.0, -0.14), (-0.17, 0.26), (-0.5, 0.36)),
                               ('center', 'left', 'right')):
        spans = [(time, pose) for time, pose, now, *_ in seen if now == state]
        robot(left, spans[len(spans) // 2][1], 0.05)
        left.text(*look, state, fontsize=8, ha=ha)
        fill, hatch = STATES[state]
        right.axvspan(spans[0][0] - COMMAND_PERIOD, spans[-1][0], facecolor=fill, hatch=hatch,
                      edgecolor='#bbbbbb', linewidth=0.0)
        right.text((spans[0][0] + spans[-1][0]) / 2.0, 1.1, state.replace('_', '\n'), ha='center',
                   va='top', fontsize=7.5)
    time = [row[0] for row in seen]
    right.plot(time, [row[4] for row in seen], color=BLUE, label='angular.z [rad/s]')
    right.plot(time, [row[3] for row in seen], color=ORANGE, linestyle='--',
               label='linear.x [m/s]')
    right.set(xlabel='time [s]', xlim=(0.0, time[-1]), ylim=(-1.3, 1.2))
    right.legend(loc='lower left', fontsize=8, framealpha=1.0)
    return figure


def offset_of_the_imu():
    """A drive that never reaches its goal, since the node turns displacements by a wrong yaw."""
    figure = Figure((5.6, 4.2), constrained_layout=True)
    axes = figure.subplots()
    plain(axes, (-1.75, 0.6), (-0.25, 1.6))
    frame(axes, Pose2(), 'local', BLUE, (0.3, 0.3), where=(0.0, -0.13), gap=0.11)
    along = Pose2(0.0, 0.0, math.atan2(LAB_GOAL.y, LAB_GOAL.x))
    believed = Pose2(0.0, 0.0, along.yaw - math.radians(OFFSET_DEG))
    mark_goal(axes)
    axes.text(LAB_GOAL.x + 0.1, LAB_GOAL.y + 0.17, 'goal', color=GREEN)
    arrow(axes, (0.0, 0.0), along.act((1.9, 0.0)), 'black')
    axes.text(*along.act((1.62, 0.0)) + (0.14, 0.06), 'true path', fontsize=10)
    arrow(axes, (0.0, 0.0), believed.act((1.75, 0.0)), ORANGE, linestyle='--')
    axes.text(*believed.act((1.25, 0.0)) + (-0.1, -0.2), 'where it believes\nto be', fontsize=10,
              color=ORANGE, ha='center')
    angle(axes, Pose2(), math.degrees(along.yaw), math.degrees(believed.yaw), 0.62,
          '{:g} deg'.format(abs(OFFSET_DEG)), GREY)
    return figure


def a_reset():
    """The two frames on the floor before and after a reset."""
    figure = Figure((8.0, 3.6), constrained_layout=True)
    here = Pose2(LAB_GOAL.x, LAB_GOAL.y, math.radians(60.0))
    left, right = figure.subplots(1, 2)
    for axes, title, local in ((left, 'before', Pose2()), (right, 'after', here)):
        plain(axes, (-1.75, 0.75), (-0.35, 1.35))
        axes.set_title(title + ' the reset', fontsize=11)
        goal = local @ LAB_GOAL
        axes.plot(goal.x, goal.y, '*', color=GREEN, markersize=15, zorder=6)
        axes.text(goal.x, goal.y - 0.28, 'goal', color=GREEN, ha='center')
        robot(axes, here, 0.09)
        frame(axes, Pose2(), 'A', BLUE, (0.4, 0.4), where=(-0.13, -0.14), gap=0.14)
    label(left, (0.1, -0.14), '= B', ORANGE, 13, fontweight='bold')
    frame(right, here, 'B', ORANGE, (0.45, 0.45), where=(0.12, -0.16), gap=0.13)
    return figure


def error_on_the_circle():
    """A turn the short way from 350 to 80 degrees, and the command as a function of the error."""
    figure = Figure((8.0, 3.3), constrained_layout=True)
    left, right = figure.subplots(1, 2, gridspec_kw=dict(width_ratios=(1, 1.35)))
    blank(left, (-1.55, 1.55), (-1.4, 1.4))
    left.add_patch(Circle((0.0, 0.0), 1.0, fill=False, color=GREY))
    for degrees in (0, 90, 180, 270):
        direction = Pose2(0.0, 0.0, math.radians(degrees)).act((1.0, 0.0))
        left.plot(*zip(0.95 * direction, 1.05 * direction), color=GREY)
        label(left, 1.22 * direction, str(degrees), GREY, 9)
    for degrees, colour, name in ((350, 'black', 'curr_yaw\n350'), (80, GREEN, 'goal_yaw 80')):
        arrow(left, (0.0, 0.0), Pose2(0.0, 0.0, math.radians(degrees)).act((1.0, 0.0)), colour)
        label(left, (1.3, -0.42) if degrees > 180 else (0.62, 1.12), name, colour, 9)
    angle(left, Pose2(), -10.0, 80.0, 0.45, '+90', GREEN)
    angle(left, Pose2(), 80.0, 350.0, 0.3, '-270', ORANGE)
    error = np.linspace(-40.0, 40.0, 1601)
    error[np.abs(error) < HDG_TOL] = np.nan
    command = np.sign(error) * np.clip(K_HDG * np.abs(error), MIN_ANG_Z, MAX_ANG_Z)
    right.plot(error, command, color=BLUE)
    right.plot([-HDG_TOL, HDG_TOL], [0.0, 0.0], color=BLUE, linewidth=3.0)
    right.axvspan(-HDG_TOL, HDG_TOL, facecolor='#d3e8d3', linewidth=0.0)
    label(right, (0.0, 1.3), 'HDG_TOL\nstop', GREEN, 9)
    right.grid(color='#e4e4e4', linewidth=0.6)
    right.set(xlabel='heading error [deg]', ylabel='angular.z [rad/s]', ylim=(-1.8, 1.85))
    for height, name in ((MAX_ANG_Z, 'MAX_ANG_Z'), (-MAX_ANG_Z, '-MAX_ANG_Z')):
        right.axhline(height, color=GREY, linewidth=0.8, linestyle=':')
        right.text(39.0, height + 0.08, name, fontsize=8, color=GREY, ha='right')
    return figure


def axes_of_the_robot():
    """The robot from above, its axes, and the direction of a positive yaw."""
    figure = Figure((4.2, 3.0), constrained_layout=True)
    axes = figure.subplots()
    blank(axes, (-1.5, 1.7), (-0.75, 1.55))
    robot(axes, Pose2(0.0, 0.0, math.pi / 2.0), 0.34)
    for side in (-0.4, 0.4):
        axes.plot((side, side), (-0.16, 0.16), color='black', linewidth=6.0, solid_capstyle='butt')
    for end, colour, text, where in (((0.0, 1.2), BLUE, 'x: forward', (0.0, 1.36)),
                                     ((-1.0, 0.0), ORANGE, 'y: left', (-1.0, -0.2))):
        arrow(axes, (0.0, 0.0), end, colour)
        label(axes, where, text, colour)
    label(axes, (0.0, -0.52), 'z: up, towards you', 'black')
    arrow(axes, (0.62, 0.5), (-0.62, 0.5), GREEN, connectionstyle='arc3,rad=0.55')
    label(axes, (1.12, 0.72), 'positive yaw:\ncounter-clockwise', GREEN)
    return figure


def turn(wrapped):
    """Returns the heading [deg] at each command of a left turn from 330 degrees by the handout's
    law. The law uses the error `wrapped` to +-180 degrees, or not."""
    turned, goal = [330.0], 330.0 + TURN_DEG
    for _ in range(int(TURN_DURATION / COMMAND_PERIOD)):
        error = goal - turned[-1] % 360.0
        error = difference_degrees(error, 0.0) if wrapped else error
        command = min(max(K_HDG * abs(error), MIN_ANG_Z), MAX_ANG_Z) * np.sign(error)
        turned.append(turned[-1] + (
            math.degrees(command) * COMMAND_PERIOD if abs(error) >= HDG_TOL else 0.0))
    return turned


def two_turns():
    """The heading over time, not wrapped, in a good turn and in a turn that does not end."""
    figure = Figure((5.1, 2.8), constrained_layout=True)
    titles = ('A good turn: it ends\nwithin the green band',
              'A bad turn: it goes on\nthrough the band')
    for axes, wrapped, title in zip(figure.subplots(1, 2), (True, False), titles):
        goal, turned = 330.0 + TURN_DEG, turn(wrapped)
        axes.axhspan(goal - HDG_TOL, goal + HDG_TOL, facecolor='#d3e8d3', linewidth=0.0)
        axes.plot([k * COMMAND_PERIOD for k in range(len(turned))], turned, color=BLUE)
        axes.set_title(title, fontsize=9)
        axes.tick_params(labelsize=7)
        axes.grid(color='#e4e4e4', linewidth=0.6)
        axes.set_xlabel('time [s]', fontsize=8)
    figure.axes[0].set_ylabel('heading [deg]', fontsize=8)
    return figure


#: {name of a file: function that returns the figure}
FIGURES = {'axes': axes_of_the_robot, 'turns': two_turns, 'reset': a_reset,
           'point': point_in_both_frames, 'heading': heading_in_both_frames,
           'states': four_states, 'imu_offset': offset_of_the_imu, 'error': error_on_the_circle}


if __name__ == '__main__':
    # each run writes the same files; letters are text, not curves
    matplotlib.rcParams.update({'svg.hashsalt': 'tb3_labs', 'svg.fonttype': 'none'})
    for name, draw in FIGURES.items():
        draw().savefig(str(DOC / 'figures' / f'{name}.svg'), metadata={'Date': None})
