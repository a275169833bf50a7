#!/usr/bin/env python3
"""Draws how usual mistakes look: doc/instructor/figures/wrong_*.svg for those who teach, and
doc/figures/turns.svg.

    python3 doc/instructor/make_wrong_figures.py

Each picture is a robot without delays, driven by the handout's law with one mistake in it.
Units: metres, radians; the turns in degrees, as in the handout.
"""
import math

from make_figures import DOC, GOAL, NEAR, mark_goal, new_figure, plain, robot, write
from tb3_labs.geometry.angle_arrays import difference_degrees
from tb3_labs.geometry.angles import wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.handout import (
    ANGLE_TOLERANCE, DRIVE_SPEED, GAIN_TO_FINAL, GAIN_TO_GOAL, HDG_TOL, K_HDG, MAX_ANG_Z, MIN_ANG_Z,
    TURN_DEG)
from tb3_labs.report.page.figures import BLUE, GREY, ORANGE

#: Time between two commands, and a picture's longest drive and turn [s].
TICK, LONGEST_DRIVE, LONGEST_TURN = 0.1, 60.0, 8.0
#: A robot that is farther than this from its start is not followed any more [m].
FAR = 1.9
#: Where the robot stood in odom when the frame was declared, and the pose before that.
AT_RESET, POWER_ON = Pose2(0.8, 0.5, math.radians(100.0)), Pose2()
#: The declared pose that one of the wrong nodes loses.
ELSEWHERE = Pose2(0.2, 0.3, math.pi / 2.0)
#: Yaw of the IMU minus the odometry's [rad].
OFFSET = math.radians(-34.6)
#: The wheels of a Burger allow this [rad/s].
FASTEST_TURN = 2.635


def pose(odom, imu, since, since_imu, rotated=None):
    """The pose in ``local`` of a robot in odom, by the IMU's yaw. At the reset it was `since` in
    odom, the IMU's yaw `since_imu`. `rotated`: the angle of R(angle)^-1, by default the odometry's
    yaw at the reset."""
    angle = since.yaw if rotated is None else rotated
    moved = Pose2(yaw=-angle) @ Pose2(odom.x - since.x, odom.y - since.y)
    return Pose2(moved.x, moved.y, wrap(imu - since_imu))


IMU_AT_RESET, IMU_AT_START = AT_RESET.yaw + OFFSET, POWER_ON.yaw + OFFSET


def drive(believes, declared):
    """(true path, believed path) in the frame that was declared: lists of Pose2.
    ``believes(odom, imu)`` is the node's pose in ``local``."""
    odom, state = AT_RESET, 'ROTATE_TO_GOAL'
    local_T_odom = declared @ AT_RESET.inverse()
    true, believed = [], []
    for _ in range(int(LONGEST_DRIVE / TICK)):
        here = believes(odom, odom.yaw + OFFSET)
        true.append(local_T_odom @ odom)
        believed.append(here)
        linear = angular = 0.0
        if state == 'ROTATE_TO_GOAL':
            error = wrap(math.atan2(GOAL.y - here.y, GOAL.x - here.x) - here.yaw)
            angular = GAIN_TO_GOAL * error
            state = state if abs(error) > ANGLE_TOLERANCE else 'MOVE_FORWARD'
        elif state == 'MOVE_FORWARD':
            linear = DRIVE_SPEED
            if math.hypot(here.x - GOAL.x, here.y - GOAL.y) < NEAR:
                state = 'ROTATE_TO_FINAL'
        else:
            error = wrap(GOAL.yaw - here.yaw)
            angular = GAIN_TO_FINAL * error
            if abs(error) < ANGLE_TOLERANCE:
                break
        odom = odom @ Pose2(linear * TICK, 0.0, angular * TICK)
        if true[-1].distance_to(declared) > FAR:
            break
    return true, believed


LOST = 'the declared pose (0.2, 0.3, 90 deg)\nis lost'
#: The title of a drive, and what its node believes.
DRIVES = [
    ('as it should be', lambda odom, imu: pose(odom, imu, AT_RESET, IMU_AT_RESET)),
    ('R in place of its inverse', lambda odom, imu: pose(
        odom, imu, AT_RESET, IMU_AT_RESET, rotated=-AT_RESET.yaw)),
    ('not rotated at all', lambda odom, imu: pose(
        odom, imu, AT_RESET, IMU_AT_RESET, rotated=0.0)),
    ("rotated by the IMU's yaw,\nwhich differs by 34.6 deg", lambda odom, imu: pose(
        odom, imu, AT_RESET, IMU_AT_RESET, rotated=IMU_AT_RESET)),
    ('the reset keeps the old yaw', lambda odom, imu: pose(
        odom, imu, AT_RESET, IMU_AT_START, rotated=POWER_ON.yaw)),
    ('the reset keeps the old x, y', lambda odom, imu: pose(
        odom, imu, POWER_ON, IMU_AT_RESET, rotated=AT_RESET.yaw)),
    (LOST, lambda odom, imu: pose(odom, imu, AT_RESET, IMU_AT_RESET)),
    ('no local frame: drives by odom', lambda odom, imu: odom)]


def wrong_drives():
    """The second drive, after a reset at 100 degrees, in the frame that was declared."""
    figure = new_figure(10.2, 5.8)
    for axes, (title, believes) in zip(figure.subplots(2, 4).flat, DRIVES):
        plain(axes, (-1.9, 1.5), (-1.5, 1.9))
        declared = ELSEWHERE if title == LOST else Pose2()
        true, believed = drive(believes, declared)
        mark_goal(axes, 11)
        axes.plot([pose.x for pose in believed], [pose.y for pose in believed], color=ORANGE,
                  linestyle='--', linewidth=1.6, label='believed')
        axes.plot([pose.x for pose in true], [pose.y for pose in true], color=BLUE, linewidth=1.6,
                  label='true')
        robot(axes, declared, 0.07, GREY)
        robot(axes, true[-1], 0.09, BLUE)
        axes.set_title(title, fontsize=9)
        axes.tick_params(labelsize=7)
        axes.set(xlabel='', ylabel='')
    figure.axes[0].legend(loc='lower right', fontsize=7)
    return figure


def turn(start, side, wrapped=True, clamped=True):
    """The heading over time [s], [deg] of a turn from `start` [deg]; `side`: 1 left, -1 right."""
    goal = start + side * TURN_DEG
    heading, turned = start, [start]
    for _ in range(int(LONGEST_TURN / TICK)):
        error = goal - heading % 360.0
        error = difference_degrees(error, 0.0) if wrapped else error
        command = K_HDG * error
        if command > 0.0:
            command = min(max(command, MIN_ANG_Z), MAX_ANG_Z)
        elif clamped:
            command = max(min(command, -MIN_ANG_Z), -MAX_ANG_Z)
        command = max(-FASTEST_TURN, min(command, FASTEST_TURN))
        if abs(error) < HDG_TOL:
            command = 0.0
        heading += math.degrees(command) * TICK
        turned.append(heading)
    return turned


TURNS = [
    ('l from 330: as it should be', turn(330.0, 1.0), 420.0),
    ('l from 330, nothing wrapped:\nit never ends', turn(330.0, 1.0, wrapped=False), 420.0),
    ('r from 40, nothing wrapped:\nit never ends', turn(40.0, -1.0, wrapped=False), -50.0),
    ('r from 200, without the\nnegative clamp: too fast', turn(200.0, -1.0, clamped=False), 110.0)]


def draw_turns(shown):
    """Turns side by side: the heading over time, continuous over whole turns."""
    figure = new_figure(2.55 * len(shown), 2.8)
    for axes, (title, turned, goal) in zip(figure.subplots(1, len(shown)), shown):
        axes.axhspan(goal - HDG_TOL, goal + HDG_TOL, facecolor='#d3e8d3', linewidth=0.0)
        axes.plot([k * TICK for k in range(len(turned))], turned, color=BLUE)
        axes.set_title(title, fontsize=9)
        axes.tick_params(labelsize=7)
        axes.grid(color='#e4e4e4', linewidth=0.6)
        axes.set_xlabel('time [s]', fontsize=8)
    figure.axes[0].set_ylabel('heading [deg]', fontsize=8)
    return figure


def wrong_turns():
    """A right turn and three wrong ones."""
    return draw_turns(TURNS)


def two_turns():
    """For the students' sheet: a good turn, and one that does not end."""
    return draw_turns([('A good turn: it ends\nwithin the green band', *TURNS[0][1:]),
                       ('A bad turn: it goes on\nthrough the band', *TURNS[1][1:])])


FIGURES = {'wrong_drives': wrong_drives, 'wrong_turns': wrong_turns}
STUDENTS = {'turns': two_turns}


if __name__ == '__main__':
    write(FIGURES, DOC / 'instructor' / 'figures')
    write(STUDENTS, DOC / 'figures')
