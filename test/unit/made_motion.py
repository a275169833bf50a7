"""Runs that are made from commands: an ideal robot does at once what it is told.

Its heading is linear and its way straight or an arc between two changes of the command, so all that
is found in them is known in closed form.
"""
import math

import numpy as np

from tb3_labs.report.run_data import Commands, ImuSamples, OdometrySamples, Poses, RunData, Values

#: Messages of the IMU, of the odometry, and commands [1/s].
IMU_RATE, ODOM_RATE, COMMAND_RATE = 100.0, 30.0, 10.0


def values(times, numbers):
    time = np.array(times, dtype=float)
    return Values(time, time, np.array(numbers, dtype=float))


def resets(*rows):
    """Poses (time, x, y, yaw) that were declared."""
    time, x, y, yaw = np.array(rows, dtype=float).reshape(-1, 4).T
    return Poses(time, time, x, y, yaw)


def driven(segments, duration=20.0, start=(0.0, 0.0, 0.0), imu_offset=0.0, **parts):
    """The run of a robot that is told (begin, end, linear, angular) [s, s, m/s, rad/s] of each of
    the segments, a zero at the end of each, and nothing between them.

    It starts at `start` in odom; the ground truth is that of odom. `parts` replace fields.
    """
    fine = np.arange(0.0, duration, 1e-3)
    linear, angular = 0.0 * fine, 0.0 * fine
    rows = []
    for begin, end, forward, turn in segments:
        now = (fine >= begin - 1e-9) & (fine < end - 1e-9)
        linear[now], angular[now] = forward, turn
        sent = np.arange(begin, end - 1e-9, 1.0 / COMMAND_RATE)
        rows += [(time, forward, turn) for time in sent] + [(end, 0.0, 0.0)]
    yaw = start[2] + 1e-3 * np.concatenate([[0.0], np.cumsum(angular)[:-1]])
    middle = yaw + 0.5e-3 * angular
    x, y = (origin + 1e-3 * np.concatenate([[0.0], np.cumsum(linear * part)[:-1]])
            for origin, part in zip(start, (np.cos(middle), np.sin(middle))))
    imu, odom = (np.arange(0.0, duration - 2e-3, 1.0 / rate) for rate in (IMU_RATE, ODOM_RATE))

    def at(time, column):
        return np.interp(time, fine, column)

    def wrapped(angles):
        return np.angle(np.exp(1j * angles))
    commands = np.array(rows).reshape(-1, 3).T
    poses = at(odom, x), at(odom, y), wrapped(at(odom, yaw))
    return RunData(**dict(dict(
        name='driven', start=1.7e9, duration=duration,
        imu=ImuSamples(imu, imu, wrapped(at(imu, yaw) + imu_offset), at(imu, angular)),
        odometry=OdometrySamples(odom, odom, *poses, at(odom, linear), at(odom, angular)),
        ground_truth=Poses(odom, odom, *poses),
        commands=Commands(commands[0], commands[0], commands[1], commands[2])), **parts))


def turn(begin, degrees, rate=1.5):
    """The segment of a turn."""
    return begin, begin + math.radians(abs(degrees)) / rate, 0.0, math.copysign(rate, degrees)


def drive(begin, first_deg, metres, last_deg, pause=0.1):
    """The segments of a turn, a straight line at 0.2 m/s and a turn, with pauses between them."""
    first = turn(begin, first_deg)
    line = first[1] + pause, first[1] + pause + metres / 0.2, 0.2, 0.0
    return [first, line, turn(line[1] + pause, last_deg)]
