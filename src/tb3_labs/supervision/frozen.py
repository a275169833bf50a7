"""Is a sensor frozen? It repeats one reading although the robot is told to move.

The readings of a working sensor always change; those of a driver that hangs do not. Units: seconds,
m/s, rad/s.
"""
from typing import Dict, Optional

from tb3_labs.supervision.freshness import Freshness

#: A sensor that repeats itself for longer than this, though the robot is told to move, is frozen
#: [s]. A slow network and slow motors delay the motion by less.
FROZEN_TIME = 0.6
#: With a command faster than this the readings must show a motion [m/s], [rad/s].
SURELY_DRIVES = 0.02
SURELY_TURNS = 0.1


class FrozenWatch:
    """Watches sources that must change while the robot is told to move."""

    def __init__(self) -> None:
        self._repeated: Dict[Freshness, float] = {}    # time of repetition [s]

    def start(self) -> None:
        """The robot stood until now: what was repeated so far does not count."""
        self._repeated = {}

    def update(self, source: Freshness, must_change: bool, dt: float) -> None:
        """Look at a source, `dt` after the last look at it [s]."""
        repeats = not source.take_new() and must_change
        self._repeated[source] = self._repeated.get(source, 0.0) + dt if repeats else 0.0

    def problem(self) -> str:
        """'' or the sources that are frozen, in words."""
        return ' and '.join(
            '{} repeats one reading though the robot is told to move (its driver '
            'hangs?)'.format(source.name)
            for source, seconds in self._repeated.items() if seconds > FROZEN_TIME)


class DriveFrozenWatch:
    """The same for a drive: from the command follows whether IMU and odometry must change."""

    def __init__(self, imu: Freshness, odometry: Freshness) -> None:
        self._watch = FrozenWatch()
        self._imu = imu
        self._odometry = odometry
        self._odometry_yaw: Optional[float] = None
        self._odometry_turned = False

    def start(self) -> None:
        """The robot stood until now: what was repeated so far does not count."""
        self._watch.start()

    def on_odometry(self, yaw: float) -> None:
        """Take in the odometry's yaw [rad]."""
        self._odometry_turned = yaw != self._odometry_yaw
        self._odometry_yaw = yaw

    def update(self, linear: float, angular: float, dt: float) -> None:
        """Look at both, `dt` [s] after the last look, at which these speeds were commanded."""
        drives, turns = abs(linear) > SURELY_DRIVES, abs(angular) > SURELY_TURNS
        self._watch.update(self._odometry, drives or turns, dt)
        # The odometry's yaw is the IMU's: if it turns, the IMU must change.
        self._watch.update(self._imu, turns or (drives and self._odometry_turned), dt)

    def problem(self) -> str:
        """'' or the sensors that are frozen, in words."""
        return self._watch.problem()
