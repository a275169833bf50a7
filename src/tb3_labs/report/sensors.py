"""The rates of a run's topics, its path length, and the difference of IMU and odometry in yaw.

Units: metres, radians, seconds since the recording's start on the recorder's clock.
Edge cases: an unknown value (one message, no IMU beside the odometry) is NaN.
"""
import math
from dataclasses import dataclass

import numpy as np

from tb3_labs.geometry.angles import continuous_at, wrap
from tb3_labs.report.run_data import OdometrySamples, RunData, Samples

#: An interval of a topic longer than this is a gap [s].
GAP = 0.3


@dataclass(frozen=True)
class YawOffset:
    """IMU's yaw minus odometry's: `mean` [rad], and continuous deviations from it at `time`."""

    mean: float
    spread: float                     # standard deviation [rad]
    drift: float                      # last tenth of the recording minus first tenth [rad]
    time: np.ndarray
    deviation: np.ndarray


@dataclass(frozen=True)
class Rate:
    """The rate of a topic, by the intervals at the sender if its messages have stamps."""

    messages: int
    mean: float                       # [1/s]
    longest: float                    # interval [s]
    gaps: int                         # intervals longer than GAP
    longest_arrival: float            # interval at the recorder [s]


def path_length(odometry: OdometrySamples) -> float:
    """Length of the path driven [m], forwards and backwards."""
    return float(np.hypot(np.diff(odometry.x), np.diff(odometry.y)).sum())


def rate(samples: Samples) -> Rate:
    """The Rate of one topic."""
    sent, arrived = np.diff(samples.time), np.diff(samples.arrival)
    if not len(sent):
        return Rate(len(samples), math.nan, math.nan, 0, math.nan)
    span = sent.sum()
    return Rate(len(samples), len(sent) / span if span > 0.0 else math.nan, float(sent.max()),
                int(np.count_nonzero(sent > GAP)), float(arrived.max()))


def imu_yaw_at(run: RunData, time: np.ndarray) -> np.ndarray:
    """The IMU's continuous yaw [rad] at each time [s], linear between two samples."""
    return continuous_at(time, run.imu.time, run.imu.yaw)


def yaw_offset(run: RunData) -> YawOffset:
    """The YawOffset at each odometry message that is not in a gap of the IMU."""
    imu_time, at = run.imu.time, run.odometry.time
    after = np.searchsorted(imu_time, at).clip(1, len(imu_time) - 1)
    close = (np.abs(imu_time[after] - at) < GAP) & (np.abs(imu_time[after - 1] - at) < GAP)
    if not close.any():
        return YawOffset(math.nan, math.nan, math.nan, np.empty(0), np.empty(0))
    offset = np.unwrap((imu_yaw_at(run, at) - np.unwrap(run.odometry.yaw))[close])
    mean, tenth = float(offset.mean()), max(1, len(offset) // 10)
    return YawOffset(wrap(mean), float(offset.std()),
                     float(offset[-tenth:].mean() - offset[:tenth].mean()), at[close],
                     offset - mean)
