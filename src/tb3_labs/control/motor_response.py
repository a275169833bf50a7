"""How late and how slowly does this robot obey? Delay and lag, identified while it moves.

A command arrives after a *delay*: it crosses the network and waits for the next control period of
the firmware. The motors then follow with a *lag*: they are modelled as first-order. A motor that
starts from rest with the command u has, a time t after the command arrived,

    the speed   v = u (1 - exp(-t / lag))
    the travel  x = u t - lag v

Two looks use this. The *look at the start* needs the speed of that moment (a gyro's). With the
share r = v / u and the way w = x / u of one sample,

    lag = w / (-log(1 - r) - r)         t = w + lag r         delay = time of the sample - t

The *look at cruise* works with any measured speed. At steady speed the commanded travel since the
start exceeds the measured travel by u (delay + lag). That gives the sum precisely.

Units: seconds; radians or metres for travel, per second for speeds. Works for either direction.
Source: the step response of a first-order system with dead time, as in K. J. Astrom and
T. Hagglund, PID Controllers: Theory, Design, and Tuning (1995), chapter 2.
"""
import math
from typing import List, Optional, Tuple

from tb3_labs.control.dead_time import CommandHistory
from tb3_labs.geometry.limits import clamp
from tb3_labs.robot.turtlebot3 import CONTROL_RATE

#: Lag of the motors until one was measured [s].
FIRST_LAG = 0.05
#: Delay until one was measured [s]: half a control period of the firmware, and 25 ms for a step of
#: the node and a quiet network.
FIRST_DELAY = 0.5 / CONTROL_RATE + 0.025
#: Measurements are clipped to these [s].
MAX_DELAY = 0.4
MAX_LAG = 0.15
#: Weight of each measurement at cruise in the estimate with which the next approach begins.
LEARNING = 0.1
#: The look at cruise wants a speed that is this near to the command (share of the command),
STEADY = 0.08
#: a command that was the same for this long [s],
STEADY_TIME = 0.12
#: and this share of the fastest speed: an error of the travel weighs more at a low speed.
CRUISING = 0.5
#: It ends this long after the start [s], before gain errors of the motors add up.
LEARNING_TIME = 1.5
#: A robot that is faster than this has begun to move [rad/s or m/s].
ONSET = 0.03
#: A first command slower than this says too little about the motors [rad/s].
TELLING = 0.2
#: Motors that reach this share of the command at the first look have no lag that can be measured.
PROMPT = 0.98


class Response:
    """Delay and lag of one robot [s]; shared by all approaches of that robot."""

    def __init__(self, delay: float = FIRST_DELAY, lag: float = FIRST_LAG) -> None:
        #: Time from a command to the moment at which the motors begin to follow it [s].
        self.delay = delay
        #: Time constant of the motors [s].
        self.lag = lag

    def measured(self, delay: float, lag: float) -> None:
        """Take in one measurement of both [s]."""
        self.delay += LEARNING * (clamp(delay, 0.0, MAX_DELAY) - self.delay)
        self.lag += LEARNING * (clamp(lag, 0.0, MAX_LAG) - self.lag)


def look_at_start(time: float, first: float, travelled: float,
                  speed: float) -> Optional[Tuple[float, float]]:
    """(delay, lag) [s] from one sample of a robot that speeds up; None where it says too little.

    `time` [s] counts from the command `first`, which was not changed since; `travelled` and `speed`
    are those of the sample. The speed must be that of the moment, not a mean over a period.
    """
    if abs(first) < TELLING or not 0.0 < speed * first:
        return None
    reached, way = speed / first, travelled / first
    lag = 0.0 if reached > PROMPT else way / (-math.log1p(-reached) - reached)
    if not 0.0 <= lag <= MAX_LAG:
        return None
    return clamp(time - way - lag * reached, 0.0, MAX_DELAY), lag


def look_at_cruise(commanded: float, travelled: float, speed: float) -> float:
    """Delay and lag together [s] of a robot at steady `speed`, by both travels since the start."""
    return clamp((commanded - travelled) / speed, 0.0, MAX_DELAY)


class Identification:
    """Delay and lag during one approach, beginning with those of earlier approaches."""

    def __init__(self, response: Response, speed_is_prompt: bool) -> None:
        """`response`: delay and lag as far as known, which this approach improves;
        `speed_is_prompt`: the measured speed is that of the moment, see ApproachConfig."""
        #: The estimate of this approach.
        self.estimate = Response(response.delay, response.lag)
        self._response = response
        self._speed_is_prompt = speed_is_prompt
        self._from_rest = False          # did the robot stand when the approach began,
        self._seen_to_start = False      # and was it seen to speed up?
        self._totals: List[float] = []   # measurements of delay and lag together [s]

    def begin(self, speed: float) -> None:
        """The first command is given now, to a robot with this measured `speed`.

        Delay and lag show only in motion that was commanded in this approach.
        """
        self._from_rest = abs(speed) <= ONSET

    def look(self, history: CommandHistory, travelled: float, speed: float,
             fastest: float) -> None:
        """Take in a sample: the travel since the start, and the measured `speed`."""
        if not self._from_rest:
            return
        if self._speed_is_prompt and not self._seen_to_start and abs(speed) > ONSET:
            self._seen_to_start = True
            seen = look_at_start(history.now, history.first, travelled, speed)
            if seen is not None:
                self.estimate.delay, self.estimate.lag = seen
        if abs(history.command) >= CRUISING * fastest and self._is_steady(history, speed):
            self._learn(look_at_cruise(history.travel, travelled, speed))

    def _is_steady(self, history: CommandHistory, speed: float) -> bool:
        return (history.unchanged_for > STEADY_TIME and history.now <= LEARNING_TIME
                and abs(speed - history.command) < STEADY * abs(history.command))

    def _learn(self, total: float) -> None:
        self._totals.append(total)
        total = sum(self._totals) / len(self._totals)
        estimate = self.estimate
        if self._speed_is_prompt:
            estimate.lag = clamp(total - estimate.delay, 0.0, MAX_LAG)
        estimate.delay = max(0.0, total - estimate.lag)
        self._response.measured(estimate.delay, estimate.lag)
