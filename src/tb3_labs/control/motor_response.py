"""Identifies the delay, the lag and the gain of a robot while it moves.

A command crosses the network and waits for the next control period of the firmware. This time is
the *delay*. The motors then follow as a first-order system with a *lag*. The steady speed is the
command times a *gain*. The gain differs a little from 1, since motors run at whole steps of speed,
and the distance of the wheels differs from robot to robot. A robot that started from rest has

    the travel   x(t) = gain U(t - delay) - lag v(t)

with the travel U that was commanded until then, and the speed v. Each sample of a robot that speeds
up, or is at steady speed, is one such equation. The equations are solved by least squares. The
approach begins with the values of earlier approaches. A larger deviation of a value gives the value
a smaller weight.

At steady speed the equation shows only the sum of delay and lag. So the first sample of a motion is
used in a different way. From rest, with the command u, a first-order motor has
v = gain u (1 - exp(-(t - delay) / lag)). With the share r = v / (gain u) and the way
w = x / (gain u) of this sample,

    lag = w / (-log(1 - r) - r)         delay = t - w - lag r

This delay is the time of the round trip, to the robot and back. A robot sets its clock over the
same slow link, so the stamps of late samples look fresh. `COMMAND_TIME` is the measured time that a
command needs. The rest of the delay is assumed to be the *sample delay*. If commands need longer
than `COMMAND_TIME`, the sample delay is too large.

Units: seconds; radians or metres for travel, per second for speeds.
Source: the step response of a first-order system with dead time, as in K. J. Astrom and
T. Hagglund, PID Controllers: Theory, Design, and Tuning (1995), chapter 2.
"""
import math
from copy import copy
from typing import Optional, Tuple

import numpy as np

from tb3_labs.control.commands import CommandHistory
from tb3_labs.geometry.angles import clamp
from tb3_labs.robot.turtlebot3 import CONTROL_RATE
from tb3_labs.supervision.timeouts import LONGEST_AGE

#: Lag of the motors before the first measurement [s].
FIRST_LAG = 0.05
#: Delay before the first measurement [s]: half a control period of the firmware, and 25 ms for a
#: step of the node and a quiet network.
FIRST_DELAY = 0.5 / CONTROL_RATE + 0.025
#: Time from a command to the moment at which the motors of a real robot begin to follow it [s]:
#: half a control period, and 8 ms for the link (firmware 1.2.6, on a fast and on a slow host).
COMMAND_TIME = 0.5 / CONTROL_RATE + 0.008
#: The delays of two commands differ by up to this [s]. A smaller excess is not a sample delay.
COMMAND_SPREAD = 0.025
#: The least sample delay, of the firmware on a fast host [s].
LEAST_SAMPLE_DELAY = 0.0135
#: The largest sample delay [s].
MAX_SAMPLE_DELAY = 0.15
#: A measured delay is clipped to this [s].
MAX_DELAY = 0.4
#: A measured lag is clipped to this [s].
MAX_LAG = 0.15
#: Standard deviations of the values with which an approach begins.
FIRST_GAIN_DEVIATION = 0.03
FIRST_DELAY_DEVIATION = 0.03    # [s]
FIRST_LAG_DEVIATION = 0.05      # [s]
#: Standard deviation of the lag, if the measured speed is a mean, which does not show the lag [s].
FIXED_LAG_DEVIATION = 1e-6
#: Standard deviation of the time of a sample, or of a command [s].
TIME_DEVIATION = 0.002
#: Weight of each measurement at cruise in the values with which the next approach begins.
LEARNING_WEIGHT = 0.1
#: Least weight of a measurement in the usual delay, which is learned over several approaches.
LEAST_LEARNING_WEIGHT = 0.01
#: The speed of a robot that cruises differs from the command by less than this share.
CRUISE_DEVIATION = 0.08
#: The command of a robot that cruises was the same for this long [s].
CRUISE_TIME = 0.12
#: Samples are used if the command has at least this share of the fastest speed.
LEAST_CRUISE_SHARE = 0.5
#: Samples are used until this time after the start [s].
LEARNING_TIME = 1.5
#: A robot that is faster than this has begun to move [rad/s or m/s].
ONSET_SPEED = 0.03
#: A robot that speeds up has a speed between these shares of the command.
SPEEDING_UP_SHARES = 0.1, 1.5
#: A first command that is slower than this does not show delay and lag well [rad/s].
SLOWEST_FIRST_COMMAND = 0.2
#: If the first sample shows more than this share of the commanded speed, the lag is 0.
PROMPT_SHARE = 0.98


class Response:
    """Delay, lag and gain of one robot. All approaches of that robot share them."""

    def __init__(self, delay: float = FIRST_DELAY, lag: float = FIRST_LAG,
                 gain: float = 1.0) -> None:
        #: Time from a command to the moment at which the motors begin to follow it [s].
        self.delay = delay
        #: Time constant of the motors [s].
        self.lag = lag
        #: Steady speed as a share of the command.
        self.gain = gain
        self._count = 0             # of measurements
        self._usual_delay = 0.0     # mean of the measured delays [s]

    @property
    def sample_delay(self) -> float:
        """The part of a sample's age that the sample's stamp does not show [s]."""
        excess = self._usual_delay - COMMAND_TIME
        if excess <= LEAST_SAMPLE_DELAY + COMMAND_SPREAD:
            return LEAST_SAMPLE_DELAY
        return min(excess, MAX_SAMPLE_DELAY)

    def learn(self, other: 'Response') -> None:
        """Take in one measurement of delay, lag and gain."""
        delay = clamp(other.delay, 0.0, MAX_DELAY)
        self._count += 1
        weight = max(LEAST_LEARNING_WEIGHT, 1.0 / self._count)
        self._usual_delay += weight * (delay - self._usual_delay)
        self.delay += LEARNING_WEIGHT * (delay - self.delay)
        self.lag += LEARNING_WEIGHT * (clamp(other.lag, 0.0, MAX_LAG) - self.lag)
        self.gain += LEARNING_WEIGHT * (other.gain - self.gain)


def identify_at_start(time: float, first: float, travelled: float,
                      speed: float) -> Optional[Tuple[float, float]]:
    """Returns (delay, lag) [s] from one sample of a robot that speeds up; None if impossible.

    `time`: since the first command [s], which was not changed; `first`: steady speed of the first
    command; `travelled`, `speed`: travel and speed of the sample. `speed` must be the speed at this
    moment, not the mean of a period.
    """
    if abs(first) < SLOWEST_FIRST_COMMAND or not 0.0 < speed * first:
        return None
    reached, distance = speed / first, travelled / first
    lag = 0.0 if reached > PROMPT_SHARE else distance / (-math.log1p(-reached) - reached)
    if not 0.0 <= lag <= MAX_LAG:
        return None
    return clamp(time - distance - lag * reached, 0.0, MAX_DELAY), lag


class Identification:
    """Identifies delay, lag and gain during one approach."""

    def __init__(self, response: Response, speed_is_prompt: bool) -> None:
        """`response` has the values of earlier approaches, and learns from this approach.
        `speed_is_prompt`: see ApproachConfig."""
        #: The estimate of this approach.
        self.estimate = copy(response)
        self._response = response
        self._first = copy(response)    # the equations are solved for the difference
        self._speed_is_prompt = speed_is_prompt
        self._from_rest = False          # did the robot stand when the approach began?
        self._start_observed = False     # did a sample show that the robot speeds up?
        lag_deviation = FIRST_LAG_DEVIATION if speed_is_prompt else FIXED_LAG_DEVIATION
        deviations = np.array([FIRST_GAIN_DEVIATION, FIRST_DELAY_DEVIATION, lag_deviation])
        self._squares, self._right = np.diag(deviations ** -2.0), np.zeros(3)

    def begin(self, speed: float) -> None:
        """Begin with a robot of this measured `speed`, just before the first command. Only a start
        from rest shows delay and lag, since an earlier command may cause another motion."""
        self._from_rest = abs(speed) <= ONSET_SPEED

    def update(self, history: CommandHistory, travelled: float, speed: float,
               fastest: float, age: float = 0.0) -> None:
        """Take in the travel since the start, and the `speed`, both measured `age` [s] ago."""
        if age > LONGEST_AGE:
            self._from_rest = False    # commands may be delayed, too
        if not self._from_rest:
            return
        if self._speed_is_prompt and not self._start_observed and abs(speed) > ONSET_SPEED:
            self._identify_at_start(history, travelled, speed, age)
        command = history.command
        if abs(command) < LEAST_CRUISE_SHARE * fastest or history.now > LEARNING_TIME:
            return
        cruises = (history.unchanged_for > CRUISE_TIME
                   and abs(speed - command) < CRUISE_DEVIATION * abs(command))
        least, most = SPEEDING_UP_SHARES
        speeds_up = (self._start_observed and least < speed / command < most
                     and history.unchanged_for > self.estimate.delay + age)
        if cruises or speeds_up:
            self._solve(history, travelled, speed, fastest, age)
        if cruises:
            self._response.learn(self.estimate)

    def _identify_at_start(self, history: CommandHistory, travelled: float, speed: float,
                           age: float) -> None:
        self._start_observed = True
        observed = identify_at_start(history.now - age, history.first * self._first.gain, travelled,
                                     speed)
        if observed is not None:
            self._first.delay, self._first.lag = observed
            self.estimate = copy(self._first)

    def _solve(self, history: CommandHistory, travelled: float, speed: float, fastest: float,
               age: float) -> None:
        """Add the equation of a sample. Solve all equations for differences from `_first`."""
        first = self._first
        arrived = history.commanded(history.now) - history.command * (first.delay + age)
        row = np.array([arrived, -first.gain * history.command, -speed])
        missing = travelled - (first.gain * arrived - first.lag * speed)
        weight = (TIME_DEVIATION * fastest) ** -2.0
        self._squares += weight * np.outer(row, row)
        self._right += weight * missing * row
        gain, delay, lag = map(float, np.linalg.solve(self._squares, self._right))
        estimate, together = self.estimate, first.delay + delay + first.lag + lag
        estimate.gain = first.gain + gain
        estimate.lag = clamp(first.lag + lag, 0.0, MAX_LAG)
        estimate.delay = clamp(together - estimate.lag, 0.0, MAX_DELAY)
