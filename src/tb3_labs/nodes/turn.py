"""One turn of `controller`, from the moment it is asked for until it is judged at rest.

Units: radians of continuous yaw, counter-clockwise positive; seconds.
"""
import math
from typing import Optional

from tb3_labs.supervision.stall import Progress


class Turn:
    """The angle that was asked for, and how well it went."""

    def __init__(self, asked: float, yaw: float, carried: float, now: float) -> None:
        """Turn by `asked` from `yaw`, and by what the turn before left to do (`carried`)."""
        self.asked = asked
        self.goal = yaw + carried + asked
        self.progress = Progress()
        self._start = yaw
        self._begun_at = now
        self._left_at_end: Optional[float] = None

    def extend(self, angle: float) -> None:
        """Turn by so much more, or less."""
        self.asked += angle
        self.goal += angle
        self.progress = Progress()

    def left(self, yaw: float) -> float:
        """The angle from `yaw` to the goal."""
        return self.goal - yaw

    def end(self, left: float) -> None:
        """The law has waited for rest and knows what is left, better than one sample does."""
        self._left_at_end = left

    def error(self, yaw: float) -> float:
        """The angle that is left of a turn that is over, of a robot that rests at `yaw`."""
        return self.left(yaw) if self._left_at_end is None else self._left_at_end

    def result(self, yaw: float, now: float) -> str:
        """How well it went, in words, of a robot that rests at `yaw`."""
        error = self.error(yaw)
        return 'Turned {:.1f} degrees in {:.1f} s: {:.2f} degrees {} the goal'.format(
            math.degrees(self.goal - error - self._start), now - self._begun_at,
            abs(math.degrees(error)), 'short of' if error * self.asked > 0.0 else 'beyond')
