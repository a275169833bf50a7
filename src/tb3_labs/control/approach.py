"""Going a remaining way to zero, and coming to rest there, in spite of delays.

A robot obeys late: a command crosses the network, waits for the firmware's next control period,
and the motors follow with a lag. What has been commanded but not yet driven is still to come;
whoever brakes by the measured position alone overshoots by it. So the braking profile here is fed
with the way that would remain if the robot were commanded to stop *now*:

    remaining - speed * motor lag - (travel of the commands still under way)

Commands are given in the firmware's own rhythm, one for each of its control periods and in step
with the first, so that each is obeyed for exactly one period: what is under way is known.

Delay and lag are learned in every approach. A first-order motor that is told to go from rest to
speed u has after a time t the speed v = u (1 - exp(-t / lag)) and the travel x = u t - lag v, so
one look while it speeds up tells both: lag = (x / u) / (-log(1 - v / u) - v / u) and
t = x / u + lag v / u. At steady speed, the travel commanded since the start exceeds the travel
measured by exactly speed * (delay + lag), which gives their sum more precisely.

Units: radians or metres for `remaining`, per second for speeds; seconds. Works for either sign.
"""
import math
from collections import deque

from tb3_labs.control.speed_laws import braking_speed, clamp
from tb3_labs.robot.turtlebot3 import CONTROL_RATE

#: Time constant with which the motors follow a new speed, until it was measured [s].
FIRST_LAG = 0.05
#: Delay assumed until one was measured [s]: half a control period of the firmware, a tick of ours,
#: and a quiet network.
FIRST_DELAY = 0.5 / CONTROL_RATE + 0.025
#: No measured response is believed beyond these [s].
MAX_DELAY = 0.4
MAX_LAG = 0.15
#: Share of each measurement at steady speed in what the next approach begins with.
LEARNING = 0.1
#: The response is measured where the speed follows the command this closely (share of it),
STEADY = 0.08
#: after the command was the same for this long [s],
STEADY_TIME = 0.12
#: at no less than this share of the fastest speed, since small errors of the way weigh more in a
#: slow one,
CRUISING = 0.5
#: and before gain errors of the motors add up [s after the start].
LEARNING_TIME = 1.5
#: A robot that is faster than this has begun to move [rad/s or m/s];
ONSET = 0.03
#: one that was told to be slower than this says too little about its motors [rad/s];
TELLING = 0.2
#: and motors that are as fast as this share of the command have no lag that a look could measure.
PROMPT = 0.98


class Response:
    """How late and how lazily a robot obeys; shared by the approaches to the same robot."""

    def __init__(self, delay=FIRST_DELAY, lag=FIRST_LAG):
        #: How long a command is under way [s].
        self.delay = delay
        #: The time constant of the motors [s].
        self.lag = lag

    def measured(self, delay, lag):
        """Take one approach's measurement in [s]."""
        self.delay += LEARNING * (clamp(delay, 0.0, MAX_DELAY) - self.delay)
        self.lag += LEARNING * (clamp(lag, 0.0, MAX_LAG) - self.lag)


class Approach:
    """One axis (turning or driving) that comes to rest where `remaining` is zero."""

    def __init__(self, period, acceleration, braking, gain, slowest, close_enough, response,
                 leave_alone=0.0, speed_is_prompt=False):
        """`period`: for so long each command is obeyed [s]; `acceleration`: the most a command
        changes by, `braking`: the deceleration that is planned with, which is less, so that the
        plan can be followed in spite of disturbance; `slowest`: floor speed that carries
        the last bit, since motors do not turn at any small speed; `close_enough`: predicted rest
        this near to zero needs no further command, so that the floor never hunts about the goal;
        `leave_alone`: nor does one this near, once the robot was told to stop; `response`: the
        robot's Response; `speed_is_prompt`: the measured speed is that of this moment (a gyro's),
        not a mean over the last control period (odometry's), which while braking is always too
        high.
        """
        self._period = period
        self._acceleration = acceleration
        self._braking = braking
        self._gain = gain
        self._slowest = slowest
        self._close_enough = close_enough
        self._leave_alone = max(close_enough, leave_alone)
        self._response = response
        self._speed_is_prompt = speed_is_prompt
        self.start()

    def start(self):
        """Begin anew with a robot that stands."""
        self._now = 0.0               # since the first command
        self._sent = deque()          # (the period it is for, as the time of its begin; command)
        self._command = 0.0
        self._same_since = 0.0
        self._commanded_travel = 0.0  # up to the last period's begin
        self._motor_speed = 0.0
        self._start_remaining = None
        self._direction = 0.0         # of the last command that was not zero,
        self._reversals = 0           # and how often it changed
        self._nudges = False          # is what moves it now a correction after a stop?
        self._delay, self._lag = self._response.delay, self._response.lag
        self._from_rest = False       # did the robot stand when this began,
        self._seen_to_start = False   # and has it been seen to speed up?
        self._totals = []             # measurements of delay and lag together
        #: What would remain if the robot were told to stop now.
        self.at_rest = math.inf

    def extend(self, by):
        """What remains has grown by `by`: another goal, on the way to the first."""
        if self._start_remaining is not None:
            self._start_remaining += by

    def told_to_rest(self, age=0.0):
        """Had nothing but a stop been commanded for as long as a command is under way, `age`
        seconds ago, and since?"""
        since = self._now - age - self._delay - 2.0 * self._period
        return not any(command for time, command in self._sent if time >= since)

    def step(self, remaining, speed, fastest, dt, backwards_from=0.0, uncertainty=0.0):
        """The speed to command, given the way left and the measured speed, `dt` after the last.

        It goes backwards only where it would come to rest beyond zero by more than
        `backwards_from`; short of that it commands a stop. By so much as `uncertainty`, `remaining`
        may be wrong: no correction is made that is smaller.
        """
        if not self._direction:    # nothing commanded yet: here it begins
            self._now, self._start_remaining, dt = 0.0, remaining, self._period
            self._sent.clear()
            # how a robot obeys shows only if all that it does was commanded here
            self._from_rest = abs(speed) <= ONSET
            if not self._speed_is_prompt:
                self._motor_speed = speed
        else:
            self._now += dt
        travelled = self._start_remaining - remaining
        if self._from_rest:
            self._look_at_start(travelled, speed)
            if abs(self._command) >= CRUISING * fastest:
                self._look_at_cruise(travelled, speed)
        self._follow_motors(speed, dt)
        begin = round(self._now / self._period) * self._period
        self.at_rest = (remaining - self._motor_speed * self._lag
                        - self._travel_under_way(begin))
        # after the first stop it is moved by nudges, and left alone sooner
        self._nudges = self._nudges or bool(self._direction and not self._command)
        near = uncertainty + (self._leave_alone if self._nudges else self._close_enough)
        wanted = 0.0
        if self.at_rest > near or self.at_rest < -max(near, backwards_from):
            # who turns back again and again has a wrong picture of the robot, and goes slower; so
            # does a nudge, which may be obeyed for two periods
            gain = self._gain / (1.0 + self._reversals + 0.5 * self._nudges)
            size = abs(braking_speed(self.at_rest, self._braking, gain))
            wanted = math.copysign(clamp(size, min(self._slowest, fastest), fastest), self.at_rest)
            if wanted * self._direction < 0.0:
                self._reversals += 1
            self._direction = wanted
        elif self._nudges and self._now - self._same_since < self._period:
            wanted = self._command    # a nudge for less than a period may never be seen
        change = self._acceleration * dt
        self._send(begin, clamp(wanted, self._command - change, self._command + change))
        return self._command

    def _send(self, begin, command):
        if self._sent:
            self._commanded_travel += self._command * (begin - self._sent[-1][0])
        if command != self._command:
            self._same_since = self._now
        self._command = command
        self._sent.append((begin, command))
        while self._sent[0][0] < self._now - MAX_DELAY - 1.0:
            self._sent.popleft()

    def _travel_under_way(self, until):
        """Travel of what was commanded within the last delay, when the period at `until` begins."""
        travel = 0.0
        horizon = self._now - self._delay
        for time, command in reversed(self._sent):
            if until <= horizon:
                break
            travel += command * (until - max(time, horizon))
            until = time
        return travel

    def _follow_motors(self, speed, dt):
        """The speed of the motors now: measured, or predicted from the command of one delay ago."""
        if self._speed_is_prompt:
            self._motor_speed = speed
            return
        horizon = self._now - self._delay
        arrived = 0.0
        for time, command in reversed(self._sent):
            if time <= horizon:
                arrived = command
                break
        share = -math.expm1(-dt / max(self._lag, 1e-6))
        self._motor_speed += share * (arrived - self._motor_speed)

    def _look_at_start(self, travelled, speed):
        """Delay and lag from the first look at a robot that speeds up."""
        if self._seen_to_start or not self._speed_is_prompt or abs(speed) <= ONSET:
            return
        self._seen_to_start = True
        first = self._sent[0][1]
        if abs(first) < TELLING or not 0.0 < speed * first:
            return
        reached, way = min(speed / first, 1.0), travelled / first
        lag = 0.0 if reached > PROMPT else way / (-math.log1p(-reached) - reached)
        if 0.0 <= lag <= MAX_LAG:
            self._lag = lag
            self._delay = clamp(self._now - way - lag * reached, 0.0, MAX_DELAY)

    def _look_at_cruise(self, travelled, speed):
        """Delay and lag together from a robot at steady speed."""
        steady = (self._now - self._same_since > STEADY_TIME
                  and abs(speed - self._command) < STEADY * abs(self._command))
        if not steady or self._now > LEARNING_TIME:
            return
        commanded = self._commanded_travel + self._command * (self._now - self._sent[-1][0])
        self._totals.append(clamp((commanded - travelled) / speed, 0.0, MAX_DELAY))
        total = sum(self._totals) / len(self._totals)
        if self._speed_is_prompt:
            self._lag = clamp(total - self._delay, 0.0, MAX_LAG)
        self._delay = max(0.0, total - self._lag)
        self._response.measured(self._delay, self._lag)
