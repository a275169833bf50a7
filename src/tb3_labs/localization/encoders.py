"""Does the odometry contradict the angles of the wheels?

If the servos do not answer (battery empty, or a cable out), the firmware repeats the last step of
its encoders. So the odometry runs on at its last speed for ever, though the robot stands. The
angles in `joint_states` stand.

Both have the stamps of one clock, so delays of the network do not matter. Cases:

* Without stamps, or without samples of the wheels, nothing is found.
* In a turn on the spot the odometry has no forward speed. supervision.stall finds a robot that does
  not turn.

Units: seconds on the sender's clock. Source: OpenCR firmware 1.2.6 (turtlebot3_core.ino): without
an answer, updateMotorInfo() is not called, but calcOdometry() is.
"""
import math
from typing import Optional

from tb3_labs.robot.samples import OdometrySample, WheelSample, is_slow

#: The odometry contradicts the wheels if it runs on for this long while they stand [s].
CONTRADICTS = 0.5
#: The contradiction in words.
CAUSE = ("the odometry runs on but the wheels stand: the servos do not answer (battery empty? a "
         "cable out?); switch the robot off and on")


class Span:
    """The time for which something has been true, by the stamps of its samples."""

    def __init__(self) -> None:
        self.begin, self.end = math.inf, -math.inf

    def look(self, is_true: bool, stamp: float) -> None:
        """Take in a sample. A clock that goes back begins anew."""
        if not (is_true and self.begin <= stamp):
            self.begin = stamp
        self.end = stamp


class EncoderWatch:
    """Compares the odometry of one robot with its wheels."""

    def __init__(self) -> None:
        self._wheels: Optional[WheelSample] = None           # the latest
        self._odometry: Optional[OdometrySample] = None
        self._stand, self._rolls = Span(), Span()

    def on_wheels(self, sample: WheelSample) -> None:
        """Take in a sample of the wheels."""
        stands = self._wheels is not None and self._wheels[1:] == sample[1:]
        self._stand.look(stands, sample.stamp)
        self._wheels = sample

    def on_odometry(self, sample: OdometrySample) -> None:
        """Take in a sample of the odometry. One that repeats a pose does not roll."""
        rolls = (self._odometry is not None and self._odometry.pose != sample.pose
                 and not is_slow(sample.linear, 0.0))
        self._rolls.look(rolls, sample.stamp)
        self._odometry = sample

    def problem(self) -> str:
        """The contradiction in words; '' if there is none."""
        together = (min(self._stand.end, self._rolls.end)
                    - max(self._stand.begin, self._rolls.begin))
        return CAUSE if together > CONTRADICTS else ''
