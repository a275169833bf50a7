"""The recordings of a real TurtleBot3 that tests read; recordings/README.md names the source."""
import pathlib

import numpy as np

FOLDER = pathlib.Path(__file__).resolve().parent / 'recordings'
NAMES = 'burger_drive', 'burger_static'


def arrays_of(name, tables=('imu', 'odometry')):
    """These arrays: rows by arrival, columns as in the README there; times since 1970 [s]."""
    with np.load(str(FOLDER / (name + '.npz'))) as file:
        arrays, begin = [file[table] for table in tables], float(file['begin'])
    for array in arrays:
        array[:, :2] += begin       # arrival and stamp
    return arrays
