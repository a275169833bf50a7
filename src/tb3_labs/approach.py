"""Going a remaining way to zero, and coming to rest there, in spite of delays.

A robot obeys late: a command crosses the network, waits for the firmware's next control period,
and the motors follow with a lag. What has been commanded but not yet driven is still to come;
whoever brakes by the measured position alone overshoots by it. So the braking profile here is fed
with the way that would remain if the robot were commanded to stop *now*:

    remaining - speed * motor lag - (travel of the commands still under way)

How long commands are under way is learned: at steady speed, the travel commanded since the start
exceeds the travel measured by exactly speed * (delay + lag).

Units: radians or metres for `remaining`, per second for speeds; seconds. Works for either sign.
"""
import math
from collections import deque

from tb3_labs.motion import braking_speed, clamp
from tb3_labs.turtlebot3 import CONTROL_RATE

#: Time constant with which the motors follow a new speed [s].
MOTOR_LAG = 0.05
#: Delay assumed until one was measured [s]: half a control period of the firmware, a tick of ours,
#: and a quiet network.
FIRST_DELAY = 0.5 / CONTROL_RATE + 0.025
#: No measured delay is believed beyond this [s].
MAX_DELAY = 0.4
#: The delay is measured where the speed follows the command this closely (share of the command),
STEADY = 0.08
#: after the command was the same for this long [s],
STEADY_TIME = 0.12
#: and before gain errors of the motors add up [s after the start].
LEARNING_TIME = 1.5
#: Braking may be this much harder than the profile plans, to follow it in spite of disturbance.
BRAKING_RESERVE = 2.0


class DelayEstimate:
    """How long a command is under way [s]; shared by approaches to the same robot."""

    def __init__(self, first=FIRST_DELAY):
        self.seconds = first

    def measured(self, seconds):
        """Take a new measurement in, smoothed."""
        self.seconds += 0.2 * (clamp(seconds, 0.0, MAX_DELAY) - self.seconds)


class Approach:
    """One axis (turning or driving) that comes to rest where `remaining` is zero."""

    def __init__(self, acceleration, gain, slowest, close_enough, delay):
        """`slowest`: floor speed that carries the last bit, since motors do not turn at any
        small speed; `close_enough`: predicted rest this near to zero needs no further command,
        so that the floor never hunts about the goal; `delay`: a DelayEstimate.
        """
        self._acceleration = acceleration
        self._gain = gain
        self._slowest = slowest
        self._close_enough = close_enough
        self._delay = delay
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
        #: What would remain if the robot were told to stop now.
        self.at_rest = math.inf

    def step(self, remaining, speed, fastest, dt, backwards_from=0.0):
        """The speed to command, given the way left and the measured speed, `dt` after the last.

        It goes backwards only where it would come to rest beyond zero by more than
        `backwards_from`; short of that it commands a stop.
        """
        if self._start_remaining is None:
            self._start_remaining = remaining
        self._now += dt
        self._commanded_travel += self._command * dt
        self._learn_delay(self._start_remaining - remaining, speed)
        self._follow_motors(dt)
        self.at_rest = remaining - self._motor_speed * MOTOR_LAG - self._travel_under_way()
        wanted = 0.0
        if self.at_rest > self._close_enough or (
                self.at_rest < -max(self._close_enough, backwards_from)):
            size = abs(braking_speed(self.at_rest, self._acceleration, self._gain))
            wanted = math.copysign(clamp(size, min(self._slowest, fastest), fastest), self.at_rest)
        self._send(self._slewed(wanted, dt))
        return self._command

    def _slewed(self, wanted, dt):
        """`wanted` within the acceleration; slowing down is allowed a reserve."""
        speeding_up = self._acceleration * dt
        slowing_down = BRAKING_RESERVE * speeding_up
        down = slowing_down if self._command > 0.0 else speeding_up
        up = slowing_down if self._command < 0.0 else speeding_up
        return clamp(wanted, self._command - down, self._command + up)

    def _send(self, command):
        if command != self._command:
            self._same_since = self._now
        self._command = command
        self._sent.append((self._now, command))
        while self._sent[0][0] < self._now - MAX_DELAY - 1.0:
            self._sent.popleft()

    def _travel_under_way(self):
        """Travel of what was commanded within the last delay."""
        travel, until = 0.0, self._now
        horizon = self._now - self._delay.seconds
        for time, command in reversed(self._sent):
            if until <= horizon:
                break
            travel += command * (until - max(time, horizon))
            until = time
        return travel

    def _follow_motors(self, dt):
        """Predict the speed of the motors: the command of one delay ago, with their lag.

        A measured speed would do as well, were it not older than that: odometry's is a mean over
        a control period, and while braking always too high.
        """
        horizon = self._now - self._delay.seconds
        arrived = 0.0
        for time, command in reversed(self._sent):
            if time <= horizon:
                arrived = command
                break
        self._motor_speed += (arrived - self._motor_speed) * -math.expm1(-dt / MOTOR_LAG)

    def _learn_delay(self, travelled, speed):
        steady = (self._now - self._same_since > STEADY_TIME and self._command != 0.0
                  and abs(speed - self._command) < STEADY * abs(self._command))
        if steady and self._now < LEARNING_TIME:
            outstanding = (self._commanded_travel - travelled) / speed
            self._delay.measured(outstanding - MOTOR_LAG)
