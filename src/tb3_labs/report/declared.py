"""The pose that a reset declared, read from the line that the node prints.

The Transformation lab asks for ``Local pose set to x=..., y=..., yaw=...``. The handout prints the
yaw in radians; other nodes print degrees. It counts as degrees if ``deg`` or a degree sign follows,
or if it is more than a whole turn in radians.
"""
import math
import re
from typing import Optional

from tb3_labs.geometry.angles import TURN, wrap
from tb3_labs.geometry.se2 import Pose2

NUMBER = r'([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)'
LINE = re.compile(r'local pose (?:set|reset) to\W*x\s*[=:]\s*{0}\s*m?\W+y\s*[=:]\s*{0}\s*m?\W+'
                  r'(?:yaw|theta)\s*[=:]\s*{0}\s*(deg|\N{{DEGREE SIGN}})?'.format(NUMBER), re.IGNORECASE)


def declared_by(line: str) -> Optional[Pose2]:
    """The declared pose of the robot in ``local``, or None if the line is no reset's."""
    found = LINE.search(line)
    if found is None:
        return None
    x, y, yaw = (float(word) for word in found.groups()[:3])
    in_degrees = found.group(4) is not None or abs(yaw) > TURN
    return Pose2(x, y, wrap(math.radians(yaw) if in_degrees else yaw))
