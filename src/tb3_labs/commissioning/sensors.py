"""The numbers of the sensors and of the network: rates, noise, drift, delays, stalls.

Each has its error, as in `estimates`. `stamp` is of the robot's clock, `arrival` of ours.

Units: SI; degrees where the name says so. A number that cannot be told is missing.
"""
import math
from typing import Dict, List, NamedTuple, Tuple

import numpy as np

from tb3_labs.commissioning import steps
from tb3_labs.commissioning.recording import Recording, Samples
from tb3_labs.geometry.angles import wrap_all

#: Standard errors of a stated error.
WIDE = 2.8
#: If no message arrives for longer than STALL, the network stalls. If the stamps have a gap longer
#: than GAP, the sensor dropped out [s].
STALL, GAP = 0.09, 0.25


class Estimate(NamedTuple):
    """A number and its error."""

    value: float
    error: float


Estimates = Dict[str, Estimate]


# At rest ------------------------------------------------------------------------------------------

def at_rest(recording: Recording) -> Estimates:
    """Rates of the sensors, and drift, noise and offset of the heading, of a robot that rests."""
    marks = recording.marked(steps.REST)
    if not marks:
        return {}
    imu, odom = (recording.samples(kind).between(marks[0].begin, marks[0].end)
                 for kind in ('imu', 'odom'))
    if len(imu) < 50 or len(odom) < 10:
        return {}
    found = {'imu_rate': _rate(imu), 'odom_rate': _rate(odom)}
    time, yaw = imu.stamp - imu.stamp[0], np.degrees(imu.turned)
    slope, start = np.polyfit(time, yaw, 1)
    noise = float(np.std(yaw - (slope * time + start)))
    doubt = noise * math.sqrt(12.0 / len(imu)) / max(time[-1], 1.0)
    found['imu_drift_deg_per_min'] = Estimate(60.0 * slope, 60.0 * WIDE * doubt + 0.05)
    found['imu_noise_deg'] = Estimate(noise, WIDE * noise / math.sqrt(2.0 * len(imu)) + 0.0005)
    apart = wrap_all(np.interp(odom.stamp, imu.stamp, imu.turned) - odom.yaw)
    middle = math.atan2(float(np.mean(np.sin(apart))), float(np.mean(np.cos(apart))))
    found['imu_offset_deg'] = Estimate(math.degrees(middle), WIDE * noise / 10.0 + 0.05)
    return found


def _rate(samples: Samples) -> Estimate:
    intervals = np.diff(samples.stamp)
    kept = intervals[np.abs(intervals) < GAP]
    rate = len(kept) / max(1e-9, float(kept.sum()))
    return Estimate(rate, 0.005 * rate)


# The network --------------------------------------------------------------------------------------

def quiet_part(recording: Recording) -> Samples:
    """The IMU's samples before the board's reset, which silences it."""
    imu = recording.samples('imu')
    resets = [mark.begin for mark in recording.marks if mark.name == steps.RESET]
    return imu.between(-math.inf, resets[0]) if resets else imu


def silences(recording: Recording) -> Tuple[List[float], List[float]]:
    """(lengths of the stalls of the network, lengths of the sensors' dropouts) [s]."""
    imu = quiet_part(recording)
    arrived, sent = np.diff(imu.arrival), np.diff(imu.stamp)
    dropouts = sent > GAP
    return list(arrived[(arrived > STALL) & ~dropouts]), list(sent[dropouts])


def network(recording: Recording) -> Estimates:
    """Delays of the samples, steps of their stamps, stalls, and the clock of the robot."""
    imu = quiet_part(recording)
    delays = imu.arrival - imu.stamp
    seconds = np.floor(imu.arrival).astype(int)
    edges = np.flatnonzero(np.diff(seconds)) + 1
    parts = [part for part in np.split(delays, edges) if len(part) >= 20]
    if len(parts) < 10:
        return {}
    least = np.array([part.min() for part in parts])
    middle = float(np.median([np.median(part - part.min()) for part in parts]))
    rate = (len(imu) + len(recording.rows['odom'])) / (imu.arrival[-1] - imu.arrival[0])
    found = {'sample_delay': Estimate(float(np.median(delays)), 0.001)}
    syncs = max(2.0, (imu.arrival[-1] - imu.arrival[0]) / 5.0)
    step = 0.5 * float(least.max() - least.min()) * (syncs + 1.0) / (syncs - 1.0)
    step = step if step > 0.003 else 0.0
    jitter = _jitter(middle, 1.0 / rate)
    found['stamp_step'] = Estimate(step, 0.0025 + 5.0 * step / syncs)
    latency = float(least.mean())
    if recording.round_trip is not None:
        half = 0.5 * recording.round_trip
        ahead = found['clock_offset'] = Estimate(half - latency, half + step + 0.001)
        if abs(ahead.value) > 0.02 + ahead.error or latency < 0.0:
            latency = half      # the clocks differ: the delay is not seen by the stamps
            found['sample_delay'] = Estimate(float(np.median(delays)) + ahead.value, ahead.error)
    spread = step / math.sqrt(3.0 * syncs)
    found['sensor_latency'] = Estimate(max(0.0, latency), WIDE * spread + 0.0015 + 0.2 * jitter)
    found['sensor_jitter'] = Estimate(jitter, 0.001 + 0.15 * jitter)
    found.update(_stalls(recording, imu.arrival[-1] - imu.arrival[0]))
    return found


def _jitter(middle: float, spacing: float) -> float:
    """The mean of the exponential delay of each message, if the median delay is `middle`: messages
    keep their order, so that each waits for those before it, which came `spacing` apart."""
    if middle < 0.0005:
        return 0.0
    low, high = 1e-5, 2.0 * middle
    for _ in range(40):
        mean = 0.5 * (low + high)
        waits = middle + spacing * np.arange(int(30.0 * mean / spacing) + 2)
        below = float(np.prod(-np.expm1(-waits / mean)))
        low, high = (mean, high) if below > 0.5 else (low, mean)
    return mean


def _stalls(recording: Recording, seconds: float) -> Estimates:
    stalls, _ = silences(recording)
    count = len(stalls)
    if not count:
        return {'stalls_per_min': Estimate(0.0, 60.0 * 3.0 / seconds)}
    longest = max(stalls) * (count + 1.0) / count if count > 2 else max(stalls)
    seen = max(0.3, 1.0 - STALL / longest)      # shorter ones are not seen
    scale = 60.0 / (seconds - sum(stalls)) / seen
    return {'stalls_per_min': Estimate(count * scale, (WIDE * math.sqrt(count) + 2.0) * scale),
            'longest_stall': Estimate(longest, 4.0 * longest / (count + 1.0) + 0.02)}
