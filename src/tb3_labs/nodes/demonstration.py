"""The demonstration: when a drive is good, and the table of all drives."""
import math
from dataclasses import dataclass
from typing import Sequence, Tuple

from tb3_labs.config import Config, setting
from tb3_labs.control.goal_state import GoalState
from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2

TABLE_ROW = '{:7} {:>17} {:>17} {:>16} {:>8}  {}'    # for a terminal of 80 columns
HEADER = TABLE_ROW.format('', 'asked [m, m, deg]', 'believed to be at', 'truly off by', 'time',
                          '').rstrip()
MAX_TRUE_ERROR = 0.01        # largest true error of the place after a good drive [m]
MAX_TRUE_ERROR_DEG = 0.5     # largest true error of the heading after a good drive [deg]


@dataclass(frozen=True)
class DemoConfig(Config):
    """Settings of the demonstration."""

    drives: int = setting(2, 'number of drives, with a reset between them', low=1, high=100)
    stay: bool = setting(False, 'go on running, and print commands to try, instead of ending')
    record: bool = setting(False, 'begin when the node record, a recorder, listens')


@dataclass(frozen=True)
class DemoDrive:
    """The result of one drive. Its poses are in the local frame."""

    state: str               # state in which the drive ended
    goal: Pose2
    believed: Pose2          # the pose at rest that move_to_goal measured
    reached: Pose2           # the true pose at rest
    time: float              # duration of the drive [s]

    @property
    def true_error(self) -> Tuple[float, float]:
        """(distance [m], angle [deg]) from the true pose to the goal."""
        return (self.reached.distance_to(self.goal),
                abs(math.degrees(difference(self.reached.yaw, self.goal.yaw))))

    @property
    def is_good(self) -> bool:
        """Did the drive end at the goal, also by its true errors?"""
        distance, angle = self.true_error
        return (self.state == GoalState.GOAL_REACHED.name
                and distance <= MAX_TRUE_ERROR and angle <= MAX_TRUE_ERROR_DEG)

    def row(self, number: int) -> str:
        distance, angle = self.true_error
        verdict = 'ok' if self.is_good else 'NOT GOOD: ' + self.state
        return TABLE_ROW.format(
            'drive {}'.format(number), _short_pose(self.goal), _short_pose(self.believed),
            '{:.1f} mm {:.2f} deg'.format(1000.0 * distance, angle), '{:.2f} s'.format(self.time),
            verdict)


def table(drives: Sequence[DemoDrive]) -> str:
    """Returns the table with an empty line before it."""
    return '\n'.join(['', HEADER] + [drive.row(number) for number, drive in enumerate(drives, 1)])


def _short_pose(pose: Pose2) -> str:
    return '{:.3f} {:.3f} {:.1f}'.format(
        pose.x, pose.y, round(math.degrees(pose.yaw), 1) + 0.0)  # not -0.0
