"""Each student's own numbers, from a hash of the name: goal, start, IMU offset, mystery robot.

skeleton.py writes them into a package, mark.py and checkoff.py compute them again. Only the letters
of a name count, in any order and without accents: "Ann Miller", "Miller, Ann" and Canvas's
"millerann" are one student. Nothing here is secret.

Only the goal matters for the judgement of a node. The nodes imu_sub, controller and gamepad hold
none of these numbers: they do the same from any start. A recording of a simulated robot is
recognized by its start and by the IMU's offset; lab_report.py --student tells whose it is.

Units: metres, degrees; poses are (x, y, heading).
"""
import hashlib
import math
import unicodedata
from typing import Dict, Iterator, NamedTuple, Tuple

from tb3_labs.geometry.angles import difference_degrees
from tb3_labs.marking.move2goal import GOAL
from tb3_labs.simulation.mystery import LAST

#: The goal's least and greatest distance from the origin: about that of the handout's goal [m].
NEAREST, FARTHEST = 0.8, 1.0
#: The start is at most this far from the odometry's origin, along x and y [m].
ASIDE = 2.0
#: A recording has a student's numbers if its start is within NEAR_PLACE of the student's [m], and
#: its heading and IMU offset are within NEAR_ANGLE [deg].
NEAR_PLACE, NEAR_ANGLE = 0.05, 3.0


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

    def recorded(self, start: Tuple[float, float, float], imu_offset: float) -> bool:
        """Does a recording with this first odometry and IMU offset have these numbers?"""
        angles = (start[2], self.start[2]), (imu_offset, self.imu_offset)
        return math.dist(start[:2], self.start[:2]) < NEAR_PLACE and all(
            abs(difference_degrees(one, other)) < NEAR_ANGLE for one, other in angles)

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
        raise ValueError('{!r} is not a name: it has no letter'.format(student))
    draws = _draws(hashlib.sha256(''.join(letters).encode()).digest())
    far, way = NEAREST + (FARTHEST - NEAREST) * next(draws), 2.0 * math.pi * next(draws)
    goal = round(far * math.cos(way), 2), round(far * math.sin(way), 2)
    start = [round(ASIDE * (2.0 * next(draws) - 1.0), 1) for _ in range(2)]
    headings = [10.0 * int(36 * next(draws)) for _ in range(2)]
    return OwnNumbers((*goal, headings[0]), (start[0], start[1], headings[1]),
                      20 + int(140 * next(draws)), 1 + int(LAST * next(draws)))


def _draws(digest: bytes) -> Iterator[float]:
    """Yields eight numbers from a digest, each at least 0 and less than 1."""
    for k in range(0, len(digest), 4):
        yield int.from_bytes(digest[k:k + 4], 'big') / 2.0 ** 32


def with_own(files: Dict[str, str], numbers: OwnNumbers) -> Dict[str, str]:
    """Returns the files of a skeleton, name -> text, with these numbers in them."""
    places = {
        'self.goal_x = {:g}\n'.format(GOAL[0]): 'self.goal_x = {:g}\n'.format(numbers.goal[0]),
        'self.goal_y = {:g}\n'.format(GOAL[1]): 'self.goal_y = {:g}\n'.format(numbers.goal[1]),
        'self.goal_yaw = 0.0\n': 'self.goal_yaw = math.radians({:g})\n'.format(numbers.goal[2]),
        'name="robot_set" default="{}"': 'name="robot_set" default="{{start_x: {:.1f}, start_y: '
        '{:.1f}, start_yaw_deg: {:g}, imu_offset_deg: {}}}"'.format(
            *numbers.start, numbers.imu_offset)}
    for given, place in places.items():
        files = {name: text.replace(given, place) for name, text in files.items()}
    return files
