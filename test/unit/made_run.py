"""A recorded run made of arrays, without a bag: a drive along x at 0.2 m/s, and given parts.

The robot stands at x = 0 until 1 s, drives until 6 s, and stands at x = 1 m; yaw 0 throughout. All
topics have 20 samples a second for 10 s, and stamps that are their arrivals.
"""
import contextlib
import csv
import re
from unittest import mock

import numpy as np

from tb3_labs.report.run_data import Commands, ImuSamples, OdometrySamples, Poses, RunData, States

TIME = np.arange(201) / 20.0
ZERO = 0.0 * TIME
X = np.interp(TIME, [1.0, 6.0], [0.0, 1.0])
STATES = ((0.5, 'ROTATE_TO_GOAL'), (1.0, 'MOVE_FORWARD'), (6.0, 'ROTATE_TO_FINAL'),
          (7.0, 'GOAL_REACHED'))


def states(*begins_and_words):
    time = np.array([begin for begin, _ in begins_and_words])
    return States(time, time, np.array([words for _, words in begins_and_words], dtype=object))


def rows_of(page):
    """The cells of each row of the tables in a page."""
    return [re.findall('<td[^>]*>(.*?)</td>', row) for row in re.findall('<tr>(.*?)</tr>', page)]


def table_in(path):
    """The rows of a CSV file."""
    with open(str(path), newline='') as file:
        return list(csv.DictReader(file))


@contextlib.contextmanager
def without_pictures():
    """The figures of a report are made, but not drawn: that takes most of a report's time."""
    with mock.patch('tb3_labs.report.page.files.write_figure', return_value=''):
        yield


def goals(time, x, y=0.0, yaw=0.0):
    """Goals in local that were sent and heard at these times."""
    time = np.array(time, dtype=float)
    return Poses(time, time, *(value + 0.0 * time for value in (np.array(x, dtype=float), y, yaw)))


def reset_lines(*times):
    """Resets of which the log tells at these times [s]; the poses are of no use."""
    return Poses(*np.array([times, times, *[[0.0] * len(times)] * 3]))


def poses(x=X, y=ZERO, yaw=ZERO, time=TIME):
    return Poses(time, time, x, y, yaw)


def made(**parts):
    """The run, with these fields instead of its own."""
    parts = dict(dict(
        name='made', start=1.7e9, duration=10.0, imu=ImuSamples(TIME, TIME, ZERO, ZERO),
        odometry=OdometrySamples(TIME, TIME, X, ZERO, ZERO, ZERO + 0.2, ZERO),
        local_pose=poses(), states=states(*STATES), commands=Commands.none(),
        goals=goals([begin for begin, _ in STATES], 1.0)), **parts)
    return RunData(**parts)
