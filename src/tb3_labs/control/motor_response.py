"""Identifies the delay, the lag and the gain of a robot while it moves.

The *delay* is the time in which a command crosses the network and waits for the next control period
of the firmware. The motors follow a command as a first-order system with the time constant *lag*.
The steady speed is the command times the *gain*. The gain is not exactly 1: motors have
discrete speeds, and robots differ in the distance between their wheels. If a robot started
from rest, its travel x, its speed v and the commanded travel U obey the equation

    x(t) = gain U(t - delay) - lag v(t)

Each sample of a robot that speeds up, or has a steady speed, gives one such equation. All equations
are solved by least squares. An approach starts with the delay, lag and gain of earlier approaches.
A start value with a larger standard deviation has less weight.

At steady speed, a sample shows only the sum of delay and lag. Therefore delay and lag are computed
from the first sample of a motion. A first-order motor that starts from rest with the command u has
the speed v = gain u (1 - exp(-(t - delay) / lag)). It follows that

    speed_share = v / (gain u)
    motion_time = x / (gain u)
    lag = motion_time / (-log(1 - speed_share) - speed_share)
    delay = t - motion_time - lag speed_share

The measured delay is the time that a command takes to reach the robot, plus the time that a sample
takes to come back. The stamp of a delayed sample looks fresh, because the robot sets its clock over
the same slow network. The *sample delay* is the measured delay minus `COMMAND_TIME`.

Units: radians or metres for travel, radians or metres per second for speeds, seconds for times.
Source: the step response of a first-order system with dead time, as in Astrom and Hagglund,
PID Controllers: Theory, Design, and Tuning (1995), chapter 2.
"""
import math
from copy import copy
from typing import Optional, Tuple

import numpy as np

from tb3_labs.control.commands import CommandHistory
from tb3_labs.geometry.angles import clamp
from tb3_labs.robot.turtlebot3 import CONTROL_RATE
from tb3_labs.supervision.timeouts import MAX_SAMPLE_AGE

INITIAL_LAG = 0.05                    # [s]; the lag that is assumed before the first measurement
FIRMWARE_WAIT = 0.5 / CONTROL_RATE    # [s]; mean wait of a command for the next control period
#: The delay [s] before the first measurement. The step of a node and a quiet network take 25 ms.
INITIAL_DELAY = FIRMWARE_WAIT + 0.025
#: Time [s] until a real robot's motors begin to follow a command. The network takes 8 ms (firmware
#: 1.2.6, on a fast and on a slow host).
COMMAND_TIME = FIRMWARE_WAIT + 0.008
COMMAND_SPREAD = 0.025       # [s]; a command's delay varies by this even if no sample is delayed
MIN_SAMPLE_DELAY = 0.0135    # [s]; it was measured on a fast host
MAX_SAMPLE_DELAY = 0.15      # [s]
MAX_DELAY = 0.4              # [s]
MAX_LAG = 0.15               # [s]
#: Standard deviations of the gain, the delay and the lag with which an approach begins.
INITIAL_GAIN_DEVIATION = 0.03
INITIAL_DELAY_DEVIATION = 0.03    # [s]
INITIAL_LAG_DEVIATION = 0.05      # [s]
FIXED_LAG_DEVIATION = 1e-6    # [s]; it keeps the lag, because mean speeds do not show the lag
TIME_DEVIATION = 0.002        # [s]; standard deviation of a sample's time, and of a command's time
#: A measurement at steady speed has this weight in the start values of the next approach.
LEARNING_WEIGHT = 0.1
MIN_LEARNING_WEIGHT = 0.01    # least weight of a measured delay in the mean delay
#: A speed is steady if it differs from the command by less than this share of the command, and the
#: command did not change for this time [s].
MAX_STEADY_DEVIATION = 0.08
MIN_STEADY_TIME = 0.12
#: A sample is used only if the command is at least this share of the fastest speed.
MIN_COMMAND_SHARE = 0.5
LEARNING_TIME = 1.5      # [s]; later samples of an approach are not used
ONSET_SPEED = 0.03       # [rad/s or m/s]; a faster robot has begun to move
MIN_ONSET_SHARE = 0.1    # lowest speed of a robot that speeds up, as a share of the command
MAX_ONSET_SHARE = 1.5    # highest speed of a robot that speeds up, as a share of the command
#: A first command that is slower than this [rad/s] does not show delay and lag well. Without this
#: limit, a turn by 0.2 degrees with a noisy gyro takes up to 3.5 s in place of 0.75 s.
MIN_FIRST_COMMAND = 0.2
#: If a first sample shows a larger share of the steady speed, the lag is 0.
MAX_SHARE_WITH_LAG = 0.98


class MotorResponse:
    """Delay, lag and gain of one robot. All approaches of the robot share them."""

    def __init__(self, delay: float = INITIAL_DELAY, lag: float = INITIAL_LAG,
                 gain: float = 1.0) -> None:
        self.delay = delay        # time [s] from a command until the motors begin to follow it
        self.lag = lag            # time constant of the motors [s]
        self.gain = gain          # steady speed as a share of the command
        self._count = 0           # number of measurements
        self._mean_delay = 0.0    # mean [s] of the measured delays

    @property
    def sample_delay(self) -> float:
        """The part [s] of a sample's age that the sample's stamp does not show."""
        excess = self._mean_delay - COMMAND_TIME
        if excess <= MIN_SAMPLE_DELAY + COMMAND_SPREAD:
            return MIN_SAMPLE_DELAY
        return min(excess, MAX_SAMPLE_DELAY)

    def learn(self, measured: 'MotorResponse') -> None:
        """Learn from one measurement of delay, lag and gain."""
        self._count += 1
        weight = max(MIN_LEARNING_WEIGHT, 1.0 / self._count)
        self._mean_delay += weight * (measured.delay - self._mean_delay)
        self.delay += LEARNING_WEIGHT * (measured.delay - self.delay)
        self.lag += LEARNING_WEIGHT * (measured.lag - self.lag)
        self.gain += LEARNING_WEIGHT * (measured.gain - self.gain)


def delay_and_lag_at_start(time: float, steady_speed: float, travel: float,
                           speed: float) -> Optional[Tuple[float, float]]:
    """Returns (delay, lag) [s] from one sample of a robot that speeds up; None if they are unknown.

    `travel` is the travel since the start. `speed` is the speed at one instant, and not a mean.
    The first command was sent `time` [s] before the sample, was not changed since, and leads to
    `steady_speed`.
    """
    follows_command = speed * steady_speed > 0.0    # False for NaN
    if not follows_command or abs(steady_speed) < MIN_FIRST_COMMAND:
        return None
    speed_share = speed / steady_speed
    motion_time = travel / steady_speed
    has_lag = speed_share <= MAX_SHARE_WITH_LAG
    lag = motion_time / (-math.log1p(-speed_share) - speed_share) if has_lag else 0.0
    if not 0.0 <= lag <= MAX_LAG:
        return None
    return clamp(time - motion_time - lag * speed_share, 0.0, MAX_DELAY), lag


class Identification:
    """Identifies delay, lag and gain during one approach."""

    def __init__(self, response: MotorResponse, measures_instant_speed: bool) -> None:
        """`response` has the values of earlier approaches and learns from this approach. For
        `measures_instant_speed`, see ApproachConfig."""
        self.estimate = copy(response)                # the estimate of this approach
        self._shared_response = response              # the response that all approaches share
        self._linearization_point = copy(response)    # the equations give changes of these values
        self._measures_instant_speed = measures_instant_speed
        self._can_identify = False      # the robot rested at the start, and no sample was late
        self._has_seen_start = False    # a sample has shown that the robot speeds up
        lag_deviation = INITIAL_LAG_DEVIATION if measures_instant_speed else FIXED_LAG_DEVIATION
        deviations = np.array([INITIAL_GAIN_DEVIATION, INITIAL_DELAY_DEVIATION, lag_deviation])
        self._normal_matrix = np.diag(deviations ** -2.0)
        self._normal_vector = np.zeros(3)

    def start(self, speed: float) -> None:
        """Start at the measured `speed`, just before the first command. If the robot moves already,
        nothing is identified, because an earlier command may cause this motion."""
        self._can_identify = abs(speed) <= ONSET_SPEED

    def update(self, history: CommandHistory, travel: float, speed: float,
               max_speed: float, age: float = 0.0) -> None:
        """Learn from a sample that is `age` [s] old. The `travel` is measured from the start."""
        if age > MAX_SAMPLE_AGE:
            self._can_identify = False    # a slow network may also delay commands
        if not self._can_identify:
            return
        is_first_motion = not self._has_seen_start and abs(speed) > ONSET_SPEED
        if self._measures_instant_speed and is_first_motion:
            self._use_first_sample(history, travel, speed, age)

        command = history.command
        if abs(command) < MIN_COMMAND_SHARE * max_speed or history.now > LEARNING_TIME:
            return
        is_near_command = abs(speed - command) < MAX_STEADY_DEVIATION * abs(command)
        is_steady = is_near_command and history.unchanged_for > MIN_STEADY_TIME
        if is_steady or self._speeds_up(history, speed, age):
            self._solve(history, travel, speed, max_speed, age)
        if is_steady:
            self._shared_response.learn(self.estimate)

    def _speeds_up(self, history: CommandHistory, speed: float, age: float) -> bool:
        command_has_arrived = history.unchanged_for > self.estimate.delay + age
        if not (self._has_seen_start and command_has_arrived):
            return False
        return MIN_ONSET_SHARE < speed / history.command < MAX_ONSET_SHARE

    def _use_first_sample(self, history: CommandHistory, travel: float, speed: float,
                          age: float) -> None:
        self._has_seen_start = True
        point = self._linearization_point
        steady_speed = history.first_command * point.gain
        observed = delay_and_lag_at_start(history.now - age, steady_speed, travel, speed)
        if observed is not None:
            point.delay, point.lag = observed
            self.estimate = copy(point)

    def _solve(self, history: CommandHistory, travel: float, speed: float, max_speed: float,
               age: float) -> None:
        """Add a sample's equation, whose `row` multiplies the changes. Solve all equations."""
        point = self._linearization_point
        travel_under_way = history.command * (point.delay + age)
        obeyed_travel = history.commanded_travel(history.now) - travel_under_way
        row = np.array([obeyed_travel, -point.gain * history.command, -speed])
        residual = travel - (point.gain * obeyed_travel - point.lag * speed)
        weight = (TIME_DEVIATION * max_speed) ** -2.0
        self._normal_matrix += weight * np.outer(row, row)
        self._normal_vector += weight * residual * row
        changes = np.linalg.solve(self._normal_matrix, self._normal_vector)
        gain_change, delay_change, lag_change = changes.tolist()
        # if the lag is clipped, the delay changes, so that the sum of both stays the same
        delay_plus_lag = point.delay + delay_change + point.lag + lag_change
        estimate = self.estimate
        estimate.gain = point.gain + gain_change
        estimate.lag = clamp(point.lag + lag_change, 0.0, MAX_LAG)
        estimate.delay = clamp(delay_plus_lag - estimate.lag, 0.0, MAX_DELAY)
