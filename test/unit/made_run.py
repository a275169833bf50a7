"""Recorded runs made of arrays, without a bag.

made(): the robot stands at x = 0 until 1 s, drives until 6 s at 0.2 m/s, and stands at x = 1 m; yaw 0
throughout. All topics have 20 samples a second for 10 s, and stamps that are their arrivals.
driven(): an ideal robot obeys at once. Its heading is linear and its way straight or
an arc between two changes of the command, so all that is found in them is known in closed form.
"""
import contextlib
import csv
import math
import re
from unittest import mock

import numpy as np

from tb3_labs.recording.run_data import (
    Commands, ImuSamples, Numbers, OdometrySamples, Poses, RunData, Texts, Variables)

TIME = np.arange(201) / 20.0
ZERO = 0.0 * TIME
X = np.interp(TIME, [1.0, 6.0], [0.0, 1.0])
STATES = ((0.5, 'ROTATE_TO_GOAL'), (1.0, 'MOVE_FORWARD'), (6.0, 'ROTATE_TO_FINAL'),
          (7.0, 'GOAL_REACHED'))


def states(*begins_and_words):
    time = np.array([begin for begin, _ in begins_and_words])
    return Texts(time, time, np.array([words for _, words in begins_and_words], dtype=object))


def rows_of(page):
    """The cells of each row of the tables in a page."""
    return [re.findall('<td[^>]*>(.*?)</td>', row) for row in re.findall('<tr>(.*?)</tr>', page)]


def table_in(path):
    with open(str(path), newline='') as file:
        return list(csv.DictReader(file))


@contextlib.contextmanager
def without_pictures():
    """Makes the figures of a report, but does not draw them: drawing takes most of a report's time."""
    with mock.patch('tb3_labs.report.page.printed_figures.png', return_value=b''):
        yield


def goals(time, x, y=0.0, yaw=0.0):
    """Goals in local that were sent and heard at these times."""
    time = np.array(time, dtype=float)
    return Poses(time, time, *(value + 0.0 * time for value in (np.array(x, dtype=float), y, yaw)))


def reset_lines(*times):
    """Resets that the log has at these times [s]; no test reads the poses."""
    return Poses(*np.array([times, times, *[[0.0] * len(times)] * 3]))


def imu_samples(arrival, time, yaw, yaw_rate):
    """Samples whose quaternions no test reads."""
    return ImuSamples(arrival, time, yaw, yaw_rate, *4 * [0.0 * time])


def speeds_sent(arrival, time, linear, angular):
    return Commands(arrival, time, linear, angular, *4 * [0.0 * time], np.full(len(time), ''))


def poses(x=X, y=ZERO, yaw=ZERO, time=TIME):
    return Poses(time, time, x, y, yaw)


def made(**parts):
    """The run, with these fields instead of its own."""
    parts = dict(dict(
        name='made', start=1.7e9, duration=10.0, imu=imu_samples(TIME, TIME, ZERO, ZERO),
        odometry=OdometrySamples(TIME, TIME, X, ZERO, ZERO, ZERO + 0.2, ZERO),
        local_pose=poses(), states=states(*STATES), commands=Commands.none(),
        goals=goals([begin for begin, _ in STATES], 1.0)), **parts)
    return RunData(**parts)


def variables(nodes=None, time=TIME, **texts):
    """Variables of a node: a name, and a text at each time, or one for all times."""
    rows = [(at, (nodes or {}).get(name, '/controller'), name,
             text if isinstance(text, str) else str(text[k]))
            for k, at in enumerate(time) for name, text in texts.items()]
    at, *columns = zip(*rows)
    return Variables(np.array(at), np.array(at), *(np.array(each, dtype=object) for each in columns))


#: Messages of the IMU, of the odometry, and commands [1/s].
IMU_RATE, ODOM_RATE, COMMAND_RATE = 100.0, 30.0, 10.0


def values(times, numbers):
    time = np.array(times, dtype=float)
    return Numbers(time, time, np.array(numbers, dtype=float))


def resets(*rows):
    """Poses (time, x, y, yaw) that were declared."""
    time, x, y, yaw = np.array(rows, dtype=float).reshape(-1, 4).T
    return Poses(time, time, x, y, yaw)


def driven(segments, duration=20.0, start=(0.0, 0.0, 0.0), imu_offset=0.0, **parts):
    """The run of a robot with a command for each of the segments (begin, end, linear, angular) [s, s, m/s, rad/s], a
    zero at the end of each, and no command between them.

    It starts at `start` in odom; the ground truth is in odom, too. `parts` replace fields.
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
        imu=imu_samples(imu, imu, wrapped(at(imu, yaw) + imu_offset), at(imu, angular)),
        odometry=OdometrySamples(odom, odom, *poses, at(odom, linear), at(odom, angular)),
        ground_truth=Poses(odom, odom, *poses),
        commands=speeds_sent(commands[0], commands[0], commands[1], commands[2])), **parts))


def turn(begin, degrees, rate=1.5):
    return begin, begin + math.radians(abs(degrees)) / rate, 0.0, math.copysign(rate, degrees)


def drive(begin, first_deg, metres, last_deg, pause=0.1):
    """The segments of a turn, a straight line at 0.2 m/s and a turn, with pauses between them."""
    first = turn(begin, first_deg)
    line = first[1] + pause, first[1] + pause + metres / 0.2, 0.2, 0.0
    return [first, line, turn(line[1] + pause, last_deg)]
