"""Learns how late the robot obeys from turns that another node commands.

A turn counts if it shows the robot's answer clearly: one command, on the spot, to a robot at rest,
and held. What changes the speed bit by bit, as the stick of a pad does, shows nothing.

Units: radians, rad/s, m/s; seconds on the receiver's clock (`now`).
"""
import math
from typing import Optional

from tb3_labs.control.dead_time import CommandHistory
from tb3_labs.control.motor_response import LONGEST_AGE, TELLING, Identification, Response
from tb3_labs.geometry.angles import continuous

#: Resolution of the time at which a command was heard [s].
RESOLUTION = 0.001
#: Before a turn that counts, no command was heard for this long [s].
QUIET = 0.6


class HeardTurns:
    """Watches one robot."""

    def __init__(self, response: Response) -> None:
        """`response`: what is known of the robot; each turn improves it."""
        self._response = response
        self._history: Optional[CommandHistory] = None    # of a turn that counts
        self._moved_at = -math.inf      # the latest command that was not zero
        self._begun_at = 0.0
        self._stood_at = 0.0            # yaw at that time [rad]
        self._yaw = self._rate = 0.0    # of the latest sample
        self._sample_at = -math.inf

    def on_command(self, linear: float, angular: float, now: float) -> None:
        """Another node told the robot to drive by `linear` and `angular`."""
        if not linear and abs(angular) >= TELLING and now > self._moved_at + QUIET:
            self._begin(angular, now)
        elif linear or self._history is None or angular != self._history.command:
            self.drop()
        if linear or angular:
            self._moved_at = now

    def on_imu(self, yaw: float, rate: float, age: float, now: float) -> None:
        """Take in a sample of the IMU that was measured `age` [s] ago."""
        if now - self._sample_at > LONGEST_AGE:
            self.drop()    # the command may have been delayed, too
        self._yaw, self._rate, self._sample_at = continuous(yaw, self._yaw), rate, now
        if self._history is not None:
            self._history.advance(now - self._begun_at - self._history.now)
            self._identification.look(self._history, self._yaw - self._stood_at, rate,
                                      abs(self._history.command), age)

    def drop(self) -> None:
        """The turn is over, or this node drives now."""
        self._history = None

    def _begin(self, angular: float, now: float) -> None:
        self._history = CommandHistory(RESOLUTION)
        self._history.send(angular)
        self._identification = Identification(self._response, speed_is_prompt=True)
        self._identification.begin(self._rate)
        self._stood_at, self._begun_at = self._yaw, now
