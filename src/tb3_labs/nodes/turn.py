"""One turn of `controller`, from the request until it is judged at rest.

Units: radians of continuous yaw, counter-clockwise positive; seconds.
"""
import math
from typing import Optional

from tb3_labs.supervision.stall import Progress


class Turn:
    """The angle that was asked for, and the result."""

    def __init__(self, asked: float, yaw: float, carried: float, now: float) -> None:
        """Turn by `asked` from `yaw`, and by the error that the turn before left (`carried`)."""
        self.asked = asked
        self.goal = yaw + carried + asked
        self.progress = Progress()
        self._start = yaw
        self._begun_at = now
        self._left_at_end: Optional[float] = None

    def extend(self, angle: float) -> None:
        """Turn by `angle` more, or less."""
        self.asked += angle
        self.goal += angle
        self.progress = Progress()

    def left(self, yaw: float) -> float:
        """The angle from `yaw` to the goal."""
        return self.goal - yaw

    def end(self, left: float) -> None:
        """The law has waited for rest, and knows the remaining angle `left` better than one sample.
        """
        self._left_at_end = left

    def error(self, yaw: float) -> float:
        """The remaining angle of a turn that is over, for a robot that rests at `yaw`."""
        return self.left(yaw) if self._left_at_end is None else self._left_at_end

    def result(self, yaw: float, now: float) -> str:
        """The result in words, for a robot that rests at `yaw`."""
        error, whole = self.error(yaw), self.goal - self._start
        made_up = math.degrees(whole - self.asked)
        return 'Turned {:.2f} degrees in {:.1f} s: {:.2f} degrees {} {:.2f}{}'.format(
            math.degrees(whole - error), now - self._begun_at, abs(math.degrees(error)),
            'short of' if error * self.asked > 0.0 else 'beyond', math.degrees(whole),
            '' if abs(made_up) < 0.005 else ' (asked: {:g}; left by the turn before: {:+.2f})'.format(
                round(math.degrees(self.asked), 2), made_up))
