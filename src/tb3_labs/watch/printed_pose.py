"""Reads the pose that a node declares in the line that it prints at a reset.

At a reset, a node of the Transformation lab prints ``Local pose set to x=..., y=..., yaw=...``. The
handout's node prints the yaw in radians, other nodes print degrees. A yaw is in degrees if ``deg``
or a degree sign follows the number, or if the number is larger than a whole turn in radians.
"""
import math
import re
from typing import Optional

from tb3_labs.geometry.angles import WHOLE_TURN, wrap
from tb3_labs.geometry.se2 import Pose2

NUMBER = r'([-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?)'
#: Matches the line that a node prints at a reset. Two neighbouring parts of this expression never
#: match the same character, so the search is fast even in a line of thousands of blanks.
RESET_LINE = re.compile(
    r'local pose (?:set|reset) to\W*x\s*[=:]\s*{0}(?:\s*m)?\W+y\s*[=:]\s*{0}(?:\s*m)?\W+'
    r'(?:yaw|theta)\s*[=:]\s*{0}\s*(deg|\N{{DEGREE SIGN}})?'.format(NUMBER), re.IGNORECASE)


def declared_pose(line: str) -> Optional[Pose2]:
    """Returns the robot's pose in ``local`` that a line declares, or None."""
    match = RESET_LINE.search(line)
    if match is None:
        return None
    x, y, yaw = map(float, match.group(1, 2, 3))
    if not math.isfinite(x + y + yaw):      # a number like 1e999
        return None
    if match.group(4) is not None or abs(yaw) > WHOLE_TURN:
        yaw = math.radians(yaw)
    return Pose2(x, y, wrap(yaw))
