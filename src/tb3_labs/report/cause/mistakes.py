"""The known mistakes of students' nodes that drive, and how a robot moves whose node makes one.

Such a robot follows the handouts' laws without delays: it turns until the error that its node
believes is small, then drives straight until the believed distance is small, then turns again. So
its movement is known in closed form, but the headings where a turn ends are searched.

A `Way` is one way in which a node computes its pose in ``local``. Several may be the same mistake.

Units: metres, radians. Angles turned are continuous, left positive; infinite if a turn never ends,
NaN if it goes left and right without an end.
"""
import math
from dataclasses import dataclass
from itertools import product
from typing import Callable, NamedTuple, Tuple

from tb3_labs.geometry.angles import wrap
from tb3_labs.geometry.se2 import Pose2

#: A turn ends within NEAR_GOAL of its goal [rad], a straight line NEAR_PLACE from the goal [m].
NEAR_GOAL, NEAR_PLACE = 0.05, 0.15
#: The end of a turn is searched in steps of at most STEP [rad], up to ENDLESS [rad]. If the turn
#: goes left and right, MOST_STEPS steps are searched.
STEP, ENDLESS, MOST_STEPS = 0.04, 3.0 * math.pi, 600


def unwrapped(error: float) -> float:
    """The error of a node that does not wrap it."""
    return error


def turned(error_at: Callable[[float], float], yaw: float, near: float) -> float:
    """The angle by which a robot turns from `yaw`, until |error_at(yaw)| < `near`."""
    angle, swings = settled(error_at, yaw, near)
    return math.nan if swings else angle


def settled(error_at: Callable[[float], float], yaw: float, near: float) -> Tuple[float, bool]:
    """As `turned`: (angle, does the robot go left and right there without an end?)."""
    angle, swings, side = 0.0, 0, 0.0
    for _ in range(MOST_STEPS):
        error = error_at(yaw + angle)
        if abs(error) <= near or swings > 4:
            return angle, abs(error) > near
        if abs(angle) > ENDLESS:
            return math.copysign(math.inf, angle), False
        swings += side * error < 0.0
        side = math.copysign(1.0, error)
        angle += side * min(STEP, abs(error) - near + 1e-6)
    return angle, True


def in_radians(yaw: float) -> float:
    """The yaw of a node that has degrees where it needs radians."""
    return math.degrees(wrap(yaw))


def mirrored(yaw: float) -> float:
    """The yaw that numbers of a quaternion give in another order."""
    return math.pi - yaw


class Declared(NamedTuple):
    """A reset: the robot in ``odom`` and the IMU's yaw at it, the pose that was declared, and its
    time [s]."""

    odom: Pose2
    imu: float
    pose: Pose2 = Pose2()
    time: float = 0.0


class Drive(NamedTuple):
    """A drive: turn, straight on, turn."""

    first_turn: float    # [rad]
    way: float           # [m]; infinite: without an end; NaN: it is chance whether it begins
    last_turn: float     # [rad]


def after(declared: Pose2, since: Pose2) -> Pose2:
    """The pose in ``local`` after a motion `since` the declared pose; its yaw is not wrapped."""
    reached = declared @ since
    return Pose2(reached.x, reached.y, since.yaw + declared.yaw)


def lost(declared: Pose2, since: Pose2) -> Pose2:
    """The pose of a node that forgets the declared one."""
    return since


class Believed(NamedTuple):
    """The numbers that a node drives by: a place, the heading of its first turn, the heading of its
    last turn. The handout's node has a line for each of the four."""

    x: float
    y: float
    course: float
    final: float

    def bearing_to(self, goal: Pose2) -> float:
        """The direction of the goal [rad]."""
        return math.atan2(goal.y - self.y, goal.x - self.x)


def by_local(odom: Pose2, imu: float, local: Pose2) -> Believed:
    """A right node drives by its pose in ``local``."""
    return Believed(local.x, local.y, local.yaw, local.yaw)


def in_global(*lines: bool) -> Callable[[Pose2, float, Pose2], Believed]:
    """A node with these lines (see Believed) still in global coordinates, the heading the IMU's."""
    return lambda odom, imu, local: Believed(*(
        far if is_global else near for is_global, far, near in zip(
            lines, (odom.x, odom.y, imu, imu), by_local(odom, imu, local))))


@dataclass(frozen=True)
class Way:
    """One way in which a node computes its pose in ``local``.

    `theta`: the angle of R(theta)^-1, by the reference for it. `keeps`: does it keep the reference
    of the place, of the rotation, of the heading, from its start, whatever is reset? `declared`:
    the pose in ``local``, of (the declared one, the pose since). `believed`: of (the odometry's
    pose, the IMU's yaw, the pose in ``local``). `reading`: the yaw that the node reads,
    by the true one. `bearing`: the direction of the goal. `arrives`: does it stop near the goal?
    `leaps`: does the heading leap, so that it is chance when a turn that goes left and right ends?
    """

    mistake: str = ''
    theta: Callable[[Declared], float] = lambda reference: reference.odom.yaw
    keeps: Tuple[bool, bool, bool] = (False, False, False)
    declared: Callable[[Pose2, Pose2], Pose2] = after
    believed: Callable[[Pose2, float, Pose2], Believed] = by_local
    reading: Callable[[float], float] = unwrapped
    bearing: Callable[[Believed, Pose2], float] = Believed.bearing_to
    wraps: Callable[[float], float] = wrap
    wraps_heading: Callable[[float], float] = wrap
    arrives: bool = True
    leaps: bool = False

    def pose(self, odom: Pose2, imu: float, last: Declared, start: Declared) -> Pose2:
        """The node's pose in ``local``, by the pose in ``odom`` and the IMU's yaw. `last`: the last
        reset; `start`: the references at the node's start, as a reset."""
        place, rotation, heading = (start if kept else last for kept in self.keeps)
        moved = Pose2(yaw=-self.theta(rotation)) @ Pose2(
            odom.x - place.odom.x, odom.y - place.odom.y)
        yaw = self.wraps_heading(self.reading(imu) - self.reading(heading.imu))
        local = self.declared(last.pose, Pose2(moved.x, moved.y, yaw))
        return Pose2(local.x, local.y, self.wraps_heading(local.yaw))

    def believes(self, odom: Pose2, imu: float, last: Declared, start: Declared) -> Believed:
        """What the node drives by; see `pose`."""
        return self.believed(odom, imu, self.pose(odom, imu, last, start))

    def drive(self, begin: Pose2, last: Declared, start: Declared, goal: Pose2,
              near: float = NEAR_GOAL) -> Drive:
        """The Drive from `begin` in ``odom`` to `goal` in ``local``; `last`, `start`: see `pose`.
        The difference of the IMU's yaw and the odometry's is that of the last reset."""
        def here(place, yaw):
            return self.believes(
                Pose2(*place, yaw), wrap(yaw + last.imu - last.odom.yaw), last, start)

        def off_course(yaw):
            seen = here((begin.x, begin.y), yaw)
            return self.wraps(self.bearing(seen, goal) - seen.course)

        first = turned(off_course, begin.yaw, near)
        if not math.isfinite(first):
            return Drive(first, math.nan if self.leaps and math.isnan(first) else 0.0, 0.0)
        yaw = begin.yaw + first
        faced = here((begin.x, begin.y), yaw)
        one_on = here((begin.x + math.cos(yaw), begin.y + math.sin(yaw)), yaw)
        way = math.inf if not self.arrives else reach(
            (goal.x - faced.x, goal.y - faced.y), (one_on.x - faced.x, one_on.y - faced.y))
        if math.isinf(way):
            return Drive(first, way, 0.0)
        end = begin.x + way * math.cos(yaw), begin.y + way * math.sin(yaw)
        return Drive(first, way, turned(
            lambda angle: self.wraps(goal.yaw - here(end, angle).final), yaw, near))


def reach(goal: Tuple[float, float], step: Tuple[float, float]) -> float:
    """The way [m] after which a robot that moves by `step` in each metre is NEAR_PLACE from `goal`;
    infinite if it passes by. Closed form: the first zero of a polynomial of degree 2. A step is
    not of length 1 if its parts are those of two frames."""
    along, square = goal[0] * step[0] + goal[1] * step[1], step[0] ** 2 + step[1] ** 2
    inside = along ** 2 - square * (goal[0] ** 2 + goal[1] ** 2 - NEAR_PLACE ** 2)
    if math.hypot(*goal) <= NEAR_PLACE:
        return 0.0
    return (along - math.sqrt(inside)) / square if inside >= 0.0 and along > 0.0 else math.inf


def in_degrees(reference: Declared) -> float:
    """The rotation of a node whose odometry's yaw is in degrees."""
    return in_radians(reference.odom.yaw)


WAYS = (
    Way(),
    Way('inverse_missing', lambda reference: -reference.odom.yaw),
    Way('not_rotated', lambda reference: 0.0),
    Way('imu_rotates', lambda reference: reference.imu),
    Way('reference_kept', keeps=(True, True, True)),
    Way('yaw_kept', keeps=(False, True, True)),
    Way('yaw_kept', keeps=(False, True, False)),
    Way('yaw_kept', keeps=(False, False, True)),
    Way('place_kept', keeps=(True, False, False)),
    Way('place_kept', keeps=(True, True, False)),
    Way('declared_lost', declared=lost),
    Way('declared_lost', declared=lambda declared, since: Pose2(    # adds the displacement as it is
        declared.x + since.x, declared.y + since.y, declared.yaw + since.yaw)),
    *(Way('no_local_frame', believed=in_global(*lines))
      for lines in product((True, False), repeat=4) if any(lines)),
    Way('no_local_frame', believed=lambda odom, imu, local: by_local(odom, imu, odom)),
    Way('no_local_frame', believed=lambda odom, imu, local: by_local(
        odom, imu, Pose2(local.x, local.y, odom.yaw))),
    Way('error_not_wrapped', wraps=unwrapped),
    Way('error_not_wrapped', wraps=unwrapped, wraps_heading=unwrapped),
    Way('heading_kept', reading=lambda yaw: 0.0),
    Way('quaternion_order', reading=lambda yaw: math.pi),
    Way('quaternion_order', reading=mirrored),
    Way('quaternion_order', lambda reference: mirrored(reference.odom.yaw), reading=mirrored),
    Way('quaternion_order', lambda reference: 0.0, reading=mirrored),
    Way('quaternion_order', lambda reference: mirrored(reference.odom.yaw)),
    Way('quaternion_order', lambda reference: math.pi),
    Way('degrees', reading=in_radians, leaps=True),
    Way('degrees', in_degrees, reading=in_radians, leaps=True),
    Way('degrees', in_degrees),
    Way('yaw_sign', reading=lambda yaw: -yaw),
    Way('atan2', bearing=lambda here, goal: math.atan2(goal.x - here.x, goal.y - here.y)),
    Way('never_arrives', arrives=False), Way('sign', wraps=lambda error: wrap(-error)),
    Way('yaw_left_out', believed=lambda odom, imu, local: Believed(
        local.x, local.y, 0.0, local.yaw)))
