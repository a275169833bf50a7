"""The settings of a drive to a goal."""
from dataclasses import dataclass

from tb3_labs.config import Config, setting


@dataclass(frozen=True)
class DriveConfig(Config):
    """Settings of a drive to a goal."""

    law: str = setting('precise', "precise, or lab for the handout's own law",
                       choices=('precise', 'lab'))
    allow_reverse: bool = setting(False, 'drive backwards where that is the shorter way')
    distance_tolerance: float = setting(0.01, 'the goal is reached within this distance', unit='m',
                                        low=0.002, high=1.0)
    angle_tolerance_deg: float = setting(0.5, 'the heading is reached within this angle',
                                         unit='deg', low=0.2, high=45.0)
    max_linear: float = setting(0.26, "fastest drive; the robot's own limit holds as well",
                                unit='m/s', low=0.02, high=1.0)
    max_angular: float = setting(1.5, "fastest turn; the robot's own limit holds as well",
                                 unit='rad/s', low=0.1, high=5.0)
    linear_acceleration: float = setting(4.0, 'speeding up; a fifth of it for braking',
                                         unit='m/s^2', low=0.1, high=10.0)
    angular_acceleration: float = setting(45.0, 'speeding up a turn; a quarter of it for braking',
                                          unit='rad/s^2', low=1.0, high=80.0)
