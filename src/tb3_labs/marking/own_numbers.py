"""Numbers of each student's own, by a hash of the name: goal, start, IMU offset, mystery robot.

skeleton.py writes them into a package, mark.py and checkoff.py compute them again. The letters of a
name count, in any order and without accents: "Ann Miller", "Miller, Ann" and Canvas's "millerann"
are one student. Only the goal of the Transformation lab is judged: the turns of the IMU lab are the
same from any start. Nothing here is secret.

Units: metres, degrees; poses are (x, y, heading).
"""
import hashlib
import math
import unicodedata
from typing import Dict, Iterator, NamedTuple, Tuple

from tb3_labs.marking.move2goal import GOAL
from tb3_labs.simulation.mystery import LAST

#: Distance of the goal from the origin: about that of the handout's [m].
NEAREST, FARTHEST = 0.8, 1.0
#: The start is at most so far from the odometry's origin, along x and y [m].
ASIDE = 2.0


class OwnNumbers(NamedTuple):
    """The numbers of one student."""

    goal: Tuple[float, float, float]
    start: Tuple[float, float, float]
    imu_offset: int
    mystery: int

    def __str__(self) -> str:
        return ('goal ({:g}, {:g}) m, {:g} degrees; start ({:g}, {:g}) m, {:g} degrees; '
                'IMU offset {:g} degrees; mystery robot {}'.format(
                    *self.goal, *self.start, self.imu_offset, self.mystery))

    @property
    def goal_pose(self) -> Tuple[float, float, float]:
        """The goal in [m] and [rad], as the lab has it."""
        x, y, heading = self.goal
        return x, y, math.radians(heading)

    @property
    def remark(self) -> str:
        """A remark for the student whose goal is judged."""
        return ('Judged by your own numbers: where a line says ({:g}, {:g}) and {:g} degrees, your '
                'goal was ({:g}, {:g}) and {:g} degrees. If your node drove elsewhere, it may hold '
                'those of another name: skeleton.py --student "YOUR NAME" tells yours.'.format(
                    *GOAL, *self.goal))


def own_numbers(student: str) -> OwnNumbers:
    """The numbers of a student; ``ValueError`` if the name has no letter."""
    letters = sorted(filter(str.isalpha, unicodedata.normalize('NFKD', student.casefold())))
    if not letters:
        raise ValueError('{!r} is no name: it has no letter'.format(student))
    draws = _draws(hashlib.sha256(''.join(letters).encode()).digest())
    far, way = NEAREST + (FARTHEST - NEAREST) * next(draws), 2.0 * math.pi * next(draws)
    goal = round(far * math.cos(way), 2), round(far * math.sin(way), 2)
    start = [round(ASIDE * (2.0 * next(draws) - 1.0), 1) for _ in range(2)]
    headings = [10.0 * int(36 * next(draws)) for _ in range(2)]
    return OwnNumbers((*goal, headings[0]), (start[0], start[1], headings[1]),
                      20 + int(140 * next(draws)), 1 + int(LAST * next(draws)))


def _draws(digest: bytes) -> Iterator[float]:
    """Numbers from 0 to 1, without 1: eight of a digest."""
    for k in range(0, len(digest), 4):
        yield int.from_bytes(digest[k:k + 4], 'big') / 2.0 ** 32


def with_own(files: Dict[str, str], numbers: OwnNumbers) -> Dict[str, str]:
    """The files of a skeleton with these numbers."""
    places = {
        'self.goal_x = {:g}\n'.format(GOAL[0]): 'self.goal_x = {:g}\n'.format(numbers.goal[0]),
        'self.goal_y = {:g}\n'.format(GOAL[1]): 'self.goal_y = {:g}\n'.format(numbers.goal[1]),
        'self.goal_yaw = 0.0\n': 'self.goal_yaw = math.radians({:g})\n'.format(numbers.goal[2]),
        'name="robot_set" default="{}"': 'name="robot_set" default="{{start_x: {:.1f}, start_y: '
        '{:.1f}, start_yaw_deg: {:g}, imu_offset_deg: {}}}"'.format(
            *numbers.start, numbers.imu_offset)}
    own = dict(files)
    for given, place in places.items():
        own = {name: text.replace(given, place) for name, text in own.items()}
    return own
