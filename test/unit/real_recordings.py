"""The recordings of a real TurtleBot3 that tests read; recordings/README.md names the source."""
import pathlib

import numpy as np

FOLDER = pathlib.Path(__file__).resolve().parent / 'recordings'
NAMES = 'burger_drive', 'burger_static'


def arrays_of(name):
    """(IMU, odometry): rows by arrival, columns as in the README there; times since 1970 [s]."""
    with np.load(str(FOLDER / (name + '.npz'))) as file:
        imu, odometry, begin = file['imu'], file['odometry'], float(file['begin'])
    for table in imu, odometry:
        table[:, :2] += begin       # arrival and stamp
    return imu, odometry
