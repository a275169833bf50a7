"""The demonstration: the criteria of a good drive, and the table of all drives."""
import math
from dataclasses import dataclass
from typing import Sequence, Tuple

from tb3_labs.config import Config, setting
from tb3_labs.control.goal_state import GoalState
from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2

#: The state of a drive that has reached its goal.
GOAL_REACHED = GoalState.GOAL_REACHED.name
#: The first state of a drive.
BEGUN = GoalState.ROTATE_TO_GOAL.name

TABLE_ROW = '{:7} {:>17} {:>17} {:>16} {:>8}  {}'  # fits a terminal of 80 columns
HEADER = TABLE_ROW.format('', 'asked [m, m, deg]', 'believed to be at', 'truly off by', 'time',
                          '').rstrip()
#: Largest true error of a good drive: of its place [m], and of its heading [deg].
TRULY_OFF, TRULY_OFF_DEG = 0.01, 0.5
#: A pose that rests moves by less than this [m], and turns by less than this [rad], in this time
#: [s].
STILL_WAY, STILL_TURN, STILL_TIME = 1e-5, 1e-5, 0.3


@dataclass(frozen=True)
class DemoConfig(Config):
    """Settings of the demonstration."""

    drives: int = setting(2, 'number of drives, with a reset between them', low=1, high=100)
    stay: bool = setting(False, 'go on running, and print commands to try, instead of ending')
    record: bool = setting(False, 'begin when the node record, a recorder, listens')


@dataclass(frozen=True)
class DemoDrive:
    """The result of one drive; poses in local."""

    state: str               # in which it ended
    goal: Pose2
    believed: Pose2          # at rest, as move_to_goal measured it
    reached: Pose2           # at rest, truly
    time: float              # [s]

    @property
    def truly_off(self) -> Tuple[float, float]:
        """(distance [m], angle [deg]) from the true pose to the goal."""
        return (self.reached.distance_to(self.goal),
                abs(math.degrees(difference(self.reached.yaw, self.goal.yaw))))

    @property
    def is_good(self) -> bool:
        """Did the drive end at its goal, truly within the tolerances (bounds included)?"""
        distance, angle = self.truly_off
        return self.state == GOAL_REACHED and distance <= TRULY_OFF and angle <= TRULY_OFF_DEG


def rests(before: Pose2, after: Pose2) -> bool:
    """Do two poses, STILL_TIME apart, show a robot at rest?"""
    return (before.distance_to(after) < STILL_WAY
            and abs(difference(after.yaw, before.yaw)) < STILL_TURN)


def table(drives: Sequence[DemoDrive]) -> str:
    """Returns an empty line, the header, and a row for each drive."""
    return '\n'.join(['', HEADER] + [_row(number, drive) for number, drive in enumerate(drives, 1)])


def _row(number, drive):
    distance, angle = drive.truly_off
    return TABLE_ROW.format(
        'drive {}'.format(number), _in_short(drive.goal), _in_short(drive.believed),
        '{:.1f} mm {:.2f} deg'.format(1000.0 * distance, angle),
        '{:.2f} s'.format(drive.time),
        'ok' if drive.is_good else 'NOT GOOD: ' + drive.state)


def _in_short(pose):
    return '{:.3f} {:.3f} {:.1f}'.format(
        pose.x, pose.y, round(math.degrees(pose.yaw), 1) + 0.0)  # not -0.0
