"""The numbers of a robot, each with its error, from what a test drive recorded.

A stated error should hold in 95 of 100 cases. It is rather too large: 2.8 standard errors of the
mean, plus the possible error of the method. test/benchmark/commission.py tries this on simulated
robots with known numbers.

Units: SI; degrees where the name says so. A number that cannot be told is missing.
"""
import math
from typing import List, Optional, Sequence

import numpy as np

from tb3_labs.commissioning import steps
from tb3_labs.commissioning.recording import Mark, Recording, Samples
from tb3_labs.commissioning.responses import Response, is_clean, response, responses
from tb3_labs.commissioning.sensors import WIDE, Estimate, Estimates, at_rest, network
from tb3_labs.robot.turtlebot3 import CONTROL_RATE, RobotModel

#: Mean and standard deviation of the wait for the board's next period [s].
WAIT, WAIT_SPREAD = 0.5 / CONTROL_RATE, 1.0 / CONTROL_RATE / math.sqrt(12.0)
#: Errors of a reading of the mark [rad], and of the tape measure [m].
READ_ANGLE, READ_WAY = math.radians(3.0), 0.003
#: An answer fits if its misfit is at most this, in seconds of its speed [s].
MISFIT = 0.004
#: The firmware's stamps wander by this in a step [s], so the lags of single steps differ.
LAG_SPREAD = 0.002


def estimates(recording: Recording, model: RobotModel) -> Estimates:
    """All numbers that the recording tells, by their names."""
    found: Estimates = {}
    if len(recording.rows['imu']) < 50 or len(recording.rows['odom']) < 10:
        return found
    found.update(at_rest(recording))
    found.update(network(recording))
    found.update(_answers(recording, model))
    found.update(_speeds(recording, found))
    found.update(_by_tape(recording, model, found))
    found.update(_stops(recording, found))
    found.update(_board(recording))
    return found


def pooled(values: Sequence[float], spread: float, floor: float) -> Estimate:
    """The mean of values that belong together, without outliers. `spread`: their least standard
    deviation; `floor`: an error that all of them may share."""
    array = np.array(values)
    middle = np.median(array)
    limit = 3.5 * max(spread, 1.48 * float(np.median(np.abs(array - middle))))
    kept = array[np.abs(array - middle) <= limit]
    deviation = max(spread, float(np.std(kept, ddof=1)) if len(kept) > 2 else 2.0 * spread)
    return Estimate(float(kept.mean()), WIDE * deviation / math.sqrt(len(kept)) + floor)


# The answers to steps -----------------------------------------------------------------------------

def clean(found: List[Response]) -> List[Response]:
    """The answers that fit the model. Those with a held-up first command are left out if others
    fit. A robot with a large lag does not rest before each step: only its first answer fits."""
    least = min((one.misfit for one in found), default=0.0)
    fitting = [one for one in found if one.misfit <= max(5.0 * least, MISFIT * abs(one.speed))]
    return [one for one in fitting if one.is_clean] or fitting


def _answers(recording: Recording, model: RobotModel) -> Estimates:
    turns = clean(responses(recording, steps.TURN, 'imu'))
    drives = clean(responses(recording, steps.DRIVE, 'odom'))
    scale = model.wheel_radius / model.wheel_separation
    by_wheels = {one.begin: one for one in responses(recording, steps.TURN, 'wheels', scale)}
    found: Estimates = {}
    for name, ones in (('turn', turns), ('drive', drives)):
        if ones:
            found[name + '_delay'] = pooled([one.delay for one in ones], WAIT_SPREAD, 0.002)
            found[name + '_lag'] = pooled([one.lag for one in ones], LAG_SPREAD, 0.001)
    ages = [one.delay - by_wheels[one.begin].delay for one in turns if one.begin in by_wheels]
    if ages:
        found['imu_after_wheels'] = pooled(ages, 0.001, 0.0015)
    lags = [found[name] for name in ('turn_lag', 'drive_lag') if name in found]
    if lags:
        weights = [lag.error ** -2.0 for lag in lags]
        value = sum(w * lag.value for w, lag in zip(weights, lags)) / sum(weights)
        found['motor_lag'] = Estimate(value, min(lag.error for lag in lags))
    return found


def _speeds(recording: Recording, found: Estimates) -> Estimates:
    """The fastest turn by the gyro, at the end of its command, and the fastest drive."""
    new: Estimates = {}
    drives, turns = clean(responses(recording, steps.FAST_DRIVE, 'odom')), []
    drift = _drift(found)
    for mark in recording.marked(steps.FAST_TURN):
        imu = recording.samples('imu').between(mark.end - 0.3, mark.end)
        if len(imu) > 5:
            turns.append(abs(float(np.median(imu.rate)) - drift))
    if turns:
        new['top_turn'] = pooled(turns, 0.004, 0.003)
    if drives:
        new['top_speed'] = pooled([abs(one.speed) for one in drives], 0.0005, 0.0005)
    return new


# The tape measure ---------------------------------------------------------------------------------

def _moved(recording: Recording, mark: Mark, kind: str) -> Optional[Samples]:
    """The samples from just before a movement until the rest after it."""
    samples = recording.samples(kind).between(mark.begin - 0.3, mark.end + 1.9)
    return samples if len(samples) > 10 else None


def _turned(recording: Recording, mark: Mark, found: Estimates) -> Optional[float]:
    """The turn by the IMU [rad], without its drift."""
    imu = _moved(recording, mark, 'imu')
    if imu is None:
        return None
    return float(imu.turned[-1] - imu.turned[0]) - _drift(found) * (imu.stamp[-1] - imu.stamp[0])


def _drift(found: Estimates) -> float:
    """The drift of the IMU's yaw [rad/s]; 0 if it is not known."""
    return math.radians(found.get('imu_drift_deg_per_min', Estimate(0.0, 0.0)).value) / 60.0


def _by_tape(recording: Recording, model: RobotModel, found: Estimates) -> Estimates:
    """Wheels and gyro, by the numbers that the person typed."""
    new: Estimates = {}
    radius, doubt = model.wheel_radius, 0.03
    for mark in recording.marked(steps.METRE):
        odom = _moved(recording, mark, 'odom')
        if odom is None:
            continue
        way = float(odom.way[-1])
        if 'metre' in recording.answers and way > 0.5:
            doubt = READ_WAY / way
            radius *= recording.answers['metre'] / 100.0 / way
            new['wheel_radius'] = Estimate(radius, radius * doubt)
        turned = _turned(recording, mark, found)
        if turned is not None and way > 0.5:
            drift = found.get('imu_drift_deg_per_min', Estimate(0.0, 5.0)).error
            value = -turned * model.wheel_separation / way
            new['wheel_mismatch'] = Estimate(
                value, 0.0006 + 0.08 * abs(value) + 0.16 * math.radians(drift) * 10.0 / 60.0)
    for mark in recording.marked(steps.ROUNDS):
        turned, wheels = _turned(recording, mark, found), _moved(recording, mark, 'wheels')
        if 'rounds' not in recording.answers or turned is None:
            continue
        truly = steps.TEN_ROUNDS + math.radians(recording.answers['rounds'])
        error = READ_ANGLE / truly
        new['gyro_scale'] = Estimate(turned / truly, error + 0.001)
        if wheels is not None:
            rolled = (wheels.right - wheels.left)[[0, -1]]
            value = radius * float(rolled[1] - rolled[0]) / truly
            new['wheel_separation'] = Estimate(value, value * (error + doubt))
    return new


# Stops and the board ------------------------------------------------------------------------------

def way_after(recording: Recording, moment: float, until: float) -> Optional[float]:
    """The way from `moment` until `until`, as seen here, by odometry [m]."""
    odom = recording.samples('odom').between(moment - 0.5, until)
    if len(odom) < 10:
        return None
    return float(odom.way[-1] - np.interp(moment, odom.stamp + odom.usual_delay, odom.way))


def _stops(recording: Recording, found: Estimates) -> Estimates:
    new: Estimates = {}
    under_way = found['drive_delay'].value if 'drive_delay' in found else 0.2
    brakes = [abs(way_after(recording, mark.end, mark.end + 0.95) or 0.0)
              for mark in recording.marked(steps.FAST_DRIVE)
              if is_clean(recording, mark.end, under_way)]
    if brakes:
        new['braking'] = pooled(brakes, 0.21 * WAIT_SPREAD, 0.002)
    outs = []
    for mark, drive in zip(recording.marked(steps.SILENCE),
                           recording.marked(steps.BEFORE_SILENCE)):
        last = max((told[0] for told in recording.told if told[0] < mark.begin - 1e-9), default=0.0)
        way, answer = way_after(recording, last, mark.end), response(recording, drive, 'odom')
        delay, lag = found.get('drive_delay'), found.get('drive_lag')
        if way and answer and delay and lag and is_clean(recording, last, delay.value):
            outs.append(way / answer.speed - lag.value - delay.value)
    if outs:
        new['time_out'] = pooled(outs, 1.5 * WAIT_SPREAD, found['drive_delay'].error)
    return new


def _board(recording: Recording) -> Estimates:
    """The step of the odometry's rate at +/-180 deg. At a reset: the board's pause, the odometry's
    first pose afterwards, and the late command."""
    new: Estimates = {}
    for mark in recording.marked(steps.ROUND):
        rates = np.abs(recording.samples('odom').between(mark.begin, mark.end).angular)
        new['wrap'] = Estimate(float(rates.max(initial=0.0)), 5.0)
    for mark in recording.marked(steps.RESET):
        imu, odom = (recording.samples(kind).between(mark.begin - 0.3, math.inf)
                     for kind in ('imu', 'odom'))
        if len(imu) < 20 or len(odom) < 10:
            continue
        gap = int(np.argmax(np.diff(imu.stamp)))
        usual = float(np.median(np.diff(imu.stamp)))
        pause = float(imu.stamp[gap + 1] - imu.stamp[gap]) - usual
        if pause < 0.5:
            continue
        new['reset_pause'] = Estimate(pause, usual + 0.05)
        after = odom.stamp > imu.stamp[gap + 1] - usual
        if after.any():
            first = int(np.argmax(after))
            new['reset_place'] = Estimate(math.hypot(odom.x[first], odom.y[first]), 0.002)
            new['reset_yaw_deg'] = Estimate(math.degrees(odom.yaw[first]), 0.1)
        for late in recording.marked(steps.LATE):
            seen = imu.arrival > imu.arrival[gap + 1]
            yaw = imu.turned
            moving = seen & (np.abs(yaw - yaw[gap + 1]) > 0.03)
            if moving.any():
                new['obeyed_late'] = Estimate(float(imu.arrival[np.argmax(moving)]) - late.begin,
                                              0.2)
    return new
