"""How a robot answers a step of its command: dead time, lag and speed, by least squares.

A command u is held from time 0 on. After the dead time D the motors follow with the lag T:

    travel(t) = v (s - T (1 - exp(-s / T))),    s = max(0, t - D)

with the steady speed v. The three numbers are found by Gauss and Newton's method with damping
(Levenberg, Marquardt). Times are those of samples as they arrive, so D is the whole dead time of a
round trip: the command's way, the wait for the board's next period, the age of the value at its
stamp, and the sample's way.

Units: seconds; radians or metres. Source: K. J. Astrom and T. Hagglund, PID Controllers (1995),
chapter 2; D. W. Marquardt, J. SIAM 11 (1963).
"""
import math
from typing import List, NamedTuple, Optional, Tuple

import numpy as np

from tb3_labs.commissioning.recording import Mark, Recording, Samples

#: The mean travel during this time before the first command is its zero [s].
BEFORE = 0.4
#: A travel of this many rad or m shows that the robot moves.
ONSET = {'imu': 0.02, 'wheels': 0.02, 'odom': 0.002}
#: A message that comes this much later than usual around a first command shows a stall [s].
HELD = 0.04
#: Least number of samples in a fit.
FEWEST = 8
#: Most steps of a fit.
TRIES = 40


class Response(NamedTuple):
    """The answer to one step."""

    begin: float            # of the first command [s]
    delay: float            # dead time [s]
    lag: float              # [s]
    speed: float            # steady, with its sign
    is_clean: bool          # was no message held up around the first command?
    misfit: float           # root mean square of the residuals


def travel(time: np.ndarray, delay: float, lag: float, speed: float) -> np.ndarray:
    """The travel at each `time` after a command."""
    since = np.maximum(0.0, time - delay)
    return speed * (since + lag * np.expm1(-since / max(lag, 1e-4)))


def fit(time: np.ndarray, values: np.ndarray, delay: float) -> Tuple[np.ndarray, float]:
    """Returns ((delay, lag, speed), root mean square), beginning with this `delay`."""
    late = time > delay + 0.1
    speed = float(np.polyfit(time[late], values[late], 1)[0]) if late.sum() > 2 else 0.0
    best = np.array([delay, 0.05, speed])
    damping, residual = 1e-2, values - travel(time, *best)
    for _ in range(TRIES):
        columns = []
        for number, step in enumerate((1e-5, 1e-5, 1e-6)):
            moved = best.copy()
            moved[number] += step
            columns.append((travel(time, *moved) - travel(time, *best)) / step)
        matrix = np.array(columns).T
        squares = matrix.T @ matrix
        change = np.linalg.lstsq(squares + damping * np.diag(np.diag(squares) + 1e-12),
                                 matrix.T @ residual, rcond=None)[0]
        tried = best + change
        tried[1] = min(max(tried[1], 1e-3), 2.0)
        new = values - travel(time, *tried)
        if new @ new < residual @ residual:
            done = bool(np.all(np.abs(tried - best) < 1e-6))
            best, residual, damping = tried, new, damping / 5.0
            if done:
                break
        else:
            damping *= 5.0
            if damping > 1e8:
                break
    return best, float(np.sqrt(np.mean(residual ** 2)))


def _values(samples: Samples, wheel_scale: float) -> np.ndarray:
    if samples.kind == 'imu':
        return samples.turned
    if samples.kind == 'wheels':
        return (samples.right - samples.left) * wheel_scale
    return samples.way


def response(recording: Recording, mark: Mark, kind: str,
             wheel_scale: float = 1.0) -> Optional[Response]:
    """The answer to a part; None if its samples say too little. `kind` of the samples: 'imu' or
    'wheels' for a turn, else 'odom'. `wheel_scale`: turn of the robot for each turn of a wheel."""
    around = recording.samples('imu').between(mark.begin - 1.0, mark.end + 1.0)
    samples = recording.samples(kind).between(mark.begin - 1.0, mark.end + 1.0)
    if len(samples) < FEWEST or len(around) < FEWEST:
        return None
    time = samples.stamp + around.usual_delay - mark.begin
    values = _values(samples, wheel_scale)
    before = (-BEFORE < time) & (time < 0.0)
    if before.sum() < 3:
        return None
    values = (values - np.mean(values[before])) * math.copysign(1.0, mark.linear or mark.angular)
    moving = np.flatnonzero((time > 0.0) & (values > ONSET[kind]))
    if not len(moving):
        return None
    delay, length = max(0.0, float(time[moving[0]]) - 0.05), mark.end - mark.begin
    chosen = (time > -BEFORE) & (time < delay + length - 0.05)
    if chosen.sum() < FEWEST:
        return None
    (delay, lag, speed), misfit = fit(time[chosen], values[chosen], delay)
    return Response(mark.begin, delay, lag, math.copysign(speed, mark.linear or mark.angular),
                    is_clean(recording, mark.begin, delay), misfit)


def is_clean(recording: Recording, moment: float, delay: float) -> bool:
    """Was nothing held up while a command of this `moment` was under way?"""
    around = recording.samples('imu').between(moment - 1.0, moment + delay + 1.0)
    late = around.arrival - around.stamp - around.usual_delay
    under_way = np.abs(around.arrival - moment - 0.5 * delay) < 0.5 * delay + 0.1
    return bool(under_way.any() and late[under_way].max() < HELD)


def responses(recording: Recording, name: str, kind: str,
              wheel_scale: float = 1.0) -> List[Response]:
    """The answers to all parts of this name."""
    found = [response(recording, mark, kind, wheel_scale) for mark in recording.marked(name)]
    return [one for one in found if one is not None]
