"""Going a remaining way to zero, and coming to rest there, in spite of delays.

A robot obeys late: a command crosses the network, waits for the firmware's next control period,
and the motors follow with a lag. What has been commanded but not yet driven is still to come;
whoever brakes by the measured position alone overshoots by it. So the braking profile here is fed
with the way that would remain if the robot were commanded to stop *now*:

    remaining - speed * motor lag - (travel of the commands still under way)

Both are learned. At steady speed, the travel commanded since the start exceeds the travel measured
by exactly speed * (delay + lag); and a gyro shows when the first command arrived, which is the
delay alone.

Units: radians or metres for `remaining`, per second for speeds; seconds. Works for either sign.
"""
import math
from collections import deque

from tb3_labs.motion import braking_speed, clamp
from tb3_labs.turtlebot3 import CONTROL_RATE

#: Time constant with which the motors follow a new speed, until it was measured [s].
FIRST_LAG = 0.05
#: Delay assumed until one was measured [s]: half a control period of the firmware, a tick of ours,
#: and a quiet network.
FIRST_DELAY = 0.5 / CONTROL_RATE + 0.025
#: No measured response is believed beyond these [s].
MAX_DELAY = 0.4
MAX_LAG = 0.15
#: Share of each new measurement in an estimate; the lag's is small, because all measurements of one
#: approach share the same onset, which a lost command makes late.
LEARNING = 0.2
LEARNING_LAG = 0.02
#: The response is measured where the speed follows the command this closely (share of it),
STEADY = 0.08
#: after the command was the same for this long [s],
STEADY_TIME = 0.12
#: at no less than this share of the fastest speed, since small errors of the way weigh more in a
#: slow one,
CRUISING = 0.5
#: and before gain errors of the motors add up [s after the start].
LEARNING_TIME = 1.5
#: A robot that is faster than this has begun to move [rad/s].
ONSET = 0.03
#: Braking is planned with this share of the acceleration; the rest is left to follow the plan in
#: spite of disturbance.
PLANNED_BRAKING = 0.5


class Response:
    """How late and how lazily a robot obeys; shared by the approaches to the same robot."""

    def __init__(self, delay=FIRST_DELAY, lag=FIRST_LAG):
        #: How long a command is under way, and the time constant of the motors, together [s].
        self.total = delay + lag
        #: The time constant alone [s].
        self.lag = lag

    @property
    def delay(self):
        """How long a command is under way [s]."""
        return max(0.0, self.total - self.lag)

    def measured(self, total, onset=None):
        """Take a new measurement in: delay and lag together, and the delay alone if known [s]."""
        total = clamp(total, 0.0, MAX_DELAY)
        self.total += LEARNING * (total - self.total)
        if onset is not None:
            self.lag += LEARNING_LAG * (clamp(total - onset, 0.0, MAX_LAG) - self.lag)


class Approach:
    """One axis (turning or driving) that comes to rest where `remaining` is zero."""

    def __init__(self, acceleration, gain, slowest, close_enough, response,
                 speed_is_prompt=False):
        """`slowest`: floor speed that carries the last bit, since motors do not turn at any
        small speed; `close_enough`: predicted rest this near to zero needs no further command,
        so that the floor never hunts about the goal; `response`: the robot's Response;
        `speed_is_prompt`: the measured speed is that of this moment (a gyro's), not a mean over
        the last control period (odometry's), which while braking is always too high.
        """
        self._acceleration = acceleration
        self._gain = gain
        self._slowest = slowest
        self._close_enough = close_enough
        self._response = response
        self._speed_is_prompt = speed_is_prompt
        self.start()

    def start(self):
        """Begin anew with a robot that stands."""
        self._now = 0.0
        self._sent = deque()          # (time, command)
        self._command = 0.0
        self._same_since = 0.0
        self._commanded_travel = 0.0
        self._motor_speed = 0.0
        self._start_remaining = None
        self._direction = 0.0         # of the last command that was not zero,
        self._reversals = 0           # and how often it changed
        self._first_sent = None
        self._onset = None            # from the first command until a robot at rest moved
        self._moved = False           # did it move when it was last looked at?
        #: What would remain if the robot were told to stop now.
        self.at_rest = math.inf

    def extend(self, by):
        """What remains has grown by `by`: another goal, on the way to the first."""
        if self._start_remaining is not None:
            self._start_remaining += by

    def step(self, remaining, speed, fastest, dt, backwards_from=0.0):
        """The speed to command, given the way left and the measured speed, `dt` after the last.

        It goes backwards only where it would come to rest beyond zero by more than
        `backwards_from`; short of that it commands a stop.
        """
        if self._start_remaining is None:
            self._start_remaining = remaining
        self._now += dt
        self._commanded_travel += self._command * dt
        if abs(self._command) >= CRUISING * fastest:
            self._learn_response(self._start_remaining - remaining, speed)
        self._follow_motors(speed, dt)
        self._watch_onset(speed, dt)
        coasting = self._motor_speed * self._response.lag
        self.at_rest = remaining - coasting - self._travel_under_way()
        wanted = 0.0
        if self.at_rest > self._close_enough or (
                self.at_rest < -max(self._close_enough, backwards_from)):
            # who turns back again and again has a wrong picture of the robot, and goes slower
            gain = self._gain / (1 + self._reversals)
            size = abs(braking_speed(self.at_rest, PLANNED_BRAKING * self._acceleration, gain))
            wanted = math.copysign(clamp(size, min(self._slowest, fastest), fastest), self.at_rest)
            if wanted * self._direction < 0.0:
                self._reversals += 1
            self._direction = wanted
        change = self._acceleration * dt
        self._send(clamp(wanted, self._command - change, self._command + change))
        return self._command

    def _send(self, command):
        if command != self._command:
            self._same_since = self._now
            if self._first_sent is None:
                self._first_sent = self._now
        self._command = command
        self._sent.append((self._now, command))
        while self._sent[0][0] < self._now - MAX_DELAY - 1.0:
            self._sent.popleft()

    def _travel_under_way(self):
        """Travel of what was commanded within the last delay."""
        travel, until = 0.0, self._now
        horizon = self._now - self._response.delay
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
        horizon = self._now - self._response.delay
        arrived = 0.0
        for time, command in reversed(self._sent):
            if time <= horizon:
                arrived = command
                break
        share = -math.expm1(-dt / max(self._response.lag, 1e-6))
        self._motor_speed += share * (arrived - self._motor_speed)

    def _watch_onset(self, speed, dt):
        """When did the robot begin to move? Somewhere between this look and the one before."""
        moves = abs(speed) > ONSET
        begins, self._moved = moves and not self._moved, moves
        if self._speed_is_prompt and begins and self._onset is None and (
                self._first_sent is not None):
            self._onset = self._now - 0.5 * dt - self._first_sent

    def _learn_response(self, travelled, speed):
        steady = (self._now - self._same_since > STEADY_TIME
                  and abs(speed - self._command) < STEADY * abs(self._command))
        if steady and self._now < LEARNING_TIME:
            self._response.measured((self._commanded_travel - travelled) / speed, self._onset)
