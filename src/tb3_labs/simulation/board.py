"""The robot's own board: it reads commands, calibrates its gyro, starts, loses its serial link.

- The newest command counts for half a second from the moment at which it is read.
- `reset` calibrates the gyro. Meanwhile the board does nothing else: the motors keep their speed,
  and commands and further resets wait in their order. The gyro takes the mean rate of turn for its
  bias.
- A start is silent, then it calibrates.
- Without the serial node each write blocks, so that the time-out is noticed late. A node that comes
  back late is a new connection: the board calibrates.

Units: SI. Source: ROBOTIS OpenCR firmware 1.2.6 (turtlebot3_core.ino), and the same code run on a
simulated body, whose times stand here.
"""
import math
import random
from collections import deque
from typing import Deque, Optional, Sequence, Tuple

from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT
from tb3_labs.simulation.network import Arrival

#: Goes to the board in the place of a command.
RESET = None
#: Time from the start of the board to its first IMU sample [s].
START_TIME = 6.2
#: The motors run on for so long when the serial node stops in a drive [s].
BLOCKED = (0.50, 0.96)
#: A serial node that was away for longer than this connects anew [s].
NEW_CONNECTION = 9.0


class Board:
    """Its present occupation, and the command that it obeys."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random('board {}'.format(seed))
        self._waiting: Deque[Arrival] = deque()     # not read yet
        self._free_since = -math.inf
        self._blocked_until = -math.inf
        self._cut_since: Optional[float] = None
        self._yaw_before = self._pause = 0.0
        #: Is it without power or starting, so that what is sent to it is lost?
        self.is_starting = False
        #: Does it neither read nor send?
        self.is_busy = False
        #: End of that [s], or infinite. An attribute, for speed.
        self.due = math.inf
        self.stop()

    def stop(self) -> None:
        """It forgets its command."""
        self._command = (-math.inf, 0.0, 0.0)   # read at [s], forward speed, rate of turn

    def switch_off(self) -> None:
        """It has no power."""
        self.stop()
        self._waiting.clear()
        self.is_starting = self.is_busy = True
        self.due = math.inf

    def start(self, now: float) -> None:
        """It starts, which ends at `due`."""
        self.is_starting = self.is_busy = True
        self.due = now + START_TIME

    def calibrate(self, now: float, pause: float, yaw: float) -> None:
        """It calibrates its gyro for `pause` [s], from the true yaw [rad], not wrapped."""
        self.is_starting, self.is_busy = False, True
        self.due = now + pause
        self._pause, self._yaw_before = pause, yaw

    def end_calibration(self, yaw: float) -> float:
        """The calibration is over, at this true yaw. Returns the gyro's bias [rad/s]."""
        self._free_since, self.due, self.is_busy = self.due, math.inf, False
        return (self._yaw_before - yaw) / self._pause if self._pause else 0.0

    def read(self, arrivals: Sequence[Arrival]) -> bool:
        """Commands and resets have arrived. Is a reset next? What came behind it waits."""
        self._waiting.extend(arrivals)
        while self._waiting and not self.is_busy:
            arrival, message = self._waiting.popleft()
            if message is RESET:
                return True
            linear, angular = message
            self._command = max(arrival, self._free_since), linear, angular
        return False

    def wanted(self, now: float) -> Tuple[float, float]:
        """(forward speed, rate of turn) that is in force."""
        read_at, linear, angular = self._command
        return (0.0, 0.0) if now - read_at > COMMAND_TIMEOUT else (linear, angular)

    # The serial link ------------------------------------------------------------------------------

    def lose_link(self, now: float) -> None:
        """The serial node is away from now on."""
        self._cut_since = now
        self._blocked_until = now + self._random.uniform(*BLOCKED)

    def regain_link(self, now: float) -> bool:
        """The serial node is back. Is that a new connection?"""
        assert self._cut_since is not None
        away, self._cut_since = now - self._cut_since, None
        return away > NEW_CONNECTION

    def is_blocked(self, now: float) -> bool:
        """Does it wait for a write to end? Without the link each loop does."""
        if self._cut_since is None or self.is_busy:
            return self.is_busy
        if now < self._blocked_until:
            return True
        self._blocked_until = now + BLOCKED[1]
        return False
