"""How late, how slowly and how fast does this robot obey? Identified while it moves.

A command arrives after a *delay*: it crosses the network and waits for the next control period of
the firmware. The motors then follow with a *lag*: they are modelled as first-order. The steady
speed is the command times a *gain*. The gain is not quite 1: motors run at whole steps of speed,
and the distance of the wheels differs from robot to robot. A robot that started from rest has

    the travel   x(t) = gain U(t - delay) - lag v(t)

with the travel U that was commanded until then, and the speed v. Each sample of a robot that speeds
up, or is at steady speed, is one such equation. The equations are solved by least squares. The
approach begins with the values of earlier approaches: the larger the doubt of a value, the smaller
its weight.

At steady speed the equation shows only the sum of delay and lag. So a *look at the start* comes
first. From rest, with the command u, a first-order motor has
v = gain u (1 - exp(-(t - delay) / lag)). With the share r = v / (gain u) and the way
w = x / (gain u) of one sample,

    lag = w / (-log(1 - r) - r)         delay = t - w - lag r

This is the delay of the round trip, to the robot and back. A robot sets its clock over the same
slow link, so the stamps of late samples look fresh. The time that a command needs is known from
measurements (`COMMAND_TIME`). The rest of the delay is assumed to be the *sample delay*. If
commands need longer than `COMMAND_TIME`, the sample delay is too large.

Units: seconds; radians or metres for travel, per second for speeds. Works for either direction.
Source: the step response of a first-order system with dead time, as in K. J. Astrom and
T. Hagglund, PID Controllers: Theory, Design, and Tuning (1995), chapter 2.
"""
import math
from copy import copy
from typing import Optional, Tuple

import numpy as np

from tb3_labs.control.braking import CommandHistory
from tb3_labs.geometry.angles import clamp
from tb3_labs.robot.turtlebot3 import CONTROL_RATE
from tb3_labs.supervision.timeouts import LONGEST_AGE

#: Lag of the motors until one was measured [s].
FIRST_LAG = 0.05
#: Delay until one was measured [s]: half a control period of the firmware, and 25 ms for a step of
#: the node and a quiet network.
FIRST_DELAY = 0.5 / CONTROL_RATE + 0.025
#: Time from a command to the moment at which the motors of a real robot begin to follow it [s]:
#: half a control period, and 8 ms for the link (firmware 1.2.6, on a fast and on a slow host).
COMMAND_TIME = 0.5 / CONTROL_RATE + 0.008
#: The delays of single commands differ by up to this, also on a busy computer [s]. So a smaller
#: excess of the delay does not show a sample delay.
COMMAND_SPREAD = 0.025
#: The least sample delay, of the firmware on a fast host [s].
LEAST_SAMPLE_DELAY = 0.0135
#: The largest sample delay [s].
MAX_SAMPLE_DELAY = 0.15
#: A measured delay is clipped to this [s].
MAX_DELAY = 0.4
#: A measured lag is clipped to this [s].
MAX_LAG = 0.15
#: Standard deviations of the values with which an approach begins: gain, delay [s], lag [s].
FIRST_DEVIATIONS = 0.03, 0.03, 0.05
#: Standard deviation of the lag if the measured speed is a mean [s]. A mean does not show the lag,
#: so this is small enough for the lag not to change.
FIXED_LAG_DEVIATION = 1e-6
#: Standard deviation of the time of a sample, or of a command [s].
TIME_DEVIATION = 0.002
#: Weight of each measurement at cruise in the values with which the next approach begins.
LEARNING = 0.1
#: Least weight of a measurement in the usual delay, which is learned over several approaches.
SLOW_LEARNING = 0.01
#: The speed of a robot that cruises differs from the command by less than this share of it.
STEADY = 0.08
#: The command of a robot that cruises was the same for this long [s].
STEADY_TIME = 0.12
#: Samples are used if the command has at least this share of the fastest speed: at a low speed an
#: error of the travel weighs more.
CRUISING = 0.5
#: Samples are used until this time after the start [s].
LEARNING_TIME = 1.5
#: A robot that is faster than this has begun to move [rad/s or m/s].
ONSET = 0.03
#: A robot that speeds up has a speed between these shares of the command.
SPEEDING_UP = 0.1, 1.5
#: A first command slower than this shows too little of the motors [rad/s].
SLOWEST_FIRST_COMMAND = 0.2
#: If the motors have more than this share of the command at the first look, their lag is 0.
PROMPT_SHARE = 0.98


class Response:
    """Delay, lag and gain of one robot; shared by all approaches of that robot."""

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
        """Part of a sample's age that its stamp does not show [s]; the least until measured."""
        excess = self._usual_delay - COMMAND_TIME
        if excess <= LEAST_SAMPLE_DELAY + COMMAND_SPREAD:
            return LEAST_SAMPLE_DELAY
        return min(excess, MAX_SAMPLE_DELAY)

    def learn(self, other: 'Response') -> None:
        """Take in one measurement of delay, lag and gain."""
        delay = clamp(other.delay, 0.0, MAX_DELAY)
        self._count += 1
        self._usual_delay += max(SLOW_LEARNING, 1.0 / self._count) * (delay - self._usual_delay)
        self.delay += LEARNING * (delay - self.delay)
        self.lag += LEARNING * (clamp(other.lag, 0.0, MAX_LAG) - self.lag)
        self.gain += LEARNING * (other.gain - self.gain)


def identify_at_start(time: float, first: float, travelled: float,
                      speed: float) -> Optional[Tuple[float, float]]:
    """Returns (delay, lag) [s] from one sample of a robot that speeds up, or None.

    `time` [s] counts from the first command, which was not changed since; `first` is the steady
    speed of this command; `travelled` and `speed` come from the sample. `speed` must be the
    speed at this moment, not a mean over a period.
    """
    if abs(first) < SLOWEST_FIRST_COMMAND or not 0.0 < speed * first:
        return None
    reached, distance = speed / first, travelled / first
    lag = 0.0 if reached > PROMPT_SHARE else distance / (-math.log1p(-reached) - reached)
    if not 0.0 <= lag <= MAX_LAG:
        return None
    return clamp(time - distance - lag * reached, 0.0, MAX_DELAY), lag


class Identification:
    """Delay, lag and gain during one approach, beginning with the values of earlier approaches."""

    def __init__(self, response: Response, speed_is_prompt: bool) -> None:
        """`response`: the known values, which this approach improves;
        `speed_is_prompt`: see ApproachConfig."""
        #: The estimate of this approach.
        self.estimate = copy(response)
        self._response = response
        self._first = copy(response)    # the equations are solved for the difference
        self._speed_is_prompt = speed_is_prompt
        self._from_rest = False          # did the robot stand when the approach began?
        self._start_observed = False     # did a sample show that it speeds up?
        gain, delay, lag = FIRST_DEVIATIONS
        doubts = np.array([gain, delay, lag if speed_is_prompt else FIXED_LAG_DEVIATION])
        self._squares, self._right = np.diag(doubts ** -2.0), np.zeros(3)

    def begin(self, speed: float) -> None:
        """Begin with a robot of this measured `speed`, just before the first command. Only a start
        from rest shows delay and lag: an earlier command may have caused another motion."""
        self._from_rest = abs(speed) <= ONSET

    def update(self, history: CommandHistory, travelled: float, speed: float,
               fastest: float, age: float = 0.0) -> None:
        """Take in a sample, measured `age` [s] ago: travel since the start, and `speed`."""
        if age > LONGEST_AGE:
            self._from_rest = False    # commands may be delayed, too
        if not self._from_rest:
            return
        if self._speed_is_prompt and not self._start_observed and abs(speed) > ONSET:
            self._identify_at_start(history, travelled, speed, age)
        command = history.command
        if abs(command) < CRUISING * fastest or history.now > LEARNING_TIME:
            return
        cruises = (history.unchanged_for > STEADY_TIME
                   and abs(speed - command) < STEADY * abs(command))
        least, most = SPEEDING_UP
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
        """Add the equation of a sample, and solve all for the differences from the first values."""
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
