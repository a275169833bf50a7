"""The known mistakes of students' nodes, and how a robot moves whose node makes one.

Such a robot follows the handouts' laws without delays: it turns until the error that its node
believes is small, then drives straight until the believed distance is small, then turns again. So
its movement is known in closed form, but the headings where a turn ends are searched.

A `Way` is one way in which a node computes its pose in ``local``; a `Law` is one in which it
computes the error of a turn. Several of them may be the same mistake.

Units: metres, radians. Angles turned are continuous, left positive; infinite if a turn never ends,
NaN if it goes left and right without an end.
"""
import math
from dataclasses import dataclass
from typing import Callable, NamedTuple, Tuple

from tb3_labs.geometry.angles import difference_degrees, wrap
from tb3_labs.geometry.se2 import Pose2, rotation_matrix

#: A turn ends within NEAR of its goal in the Transformation lab, NEAR_TURN in the IMU lab [rad]; a
#: straight line NEAR_PLACE from the goal [m].
NEAR, NEAR_TURN, NEAR_PLACE = 0.05, math.radians(10.0), 0.15
#: The end of a turn is searched in steps of at most STEP [rad], up to ENDLESS [rad]. If the turn
#: goes left and right, MOST_STEPS steps are searched.
STEP, ENDLESS, MOST_STEPS = 0.04, 3.0 * math.pi, 600


def unwrapped(error: float) -> float:
    """The error of a node that does not wrap it."""
    return error


def turned(error_at: Callable[[float], float], yaw: float, near: float) -> float:
    """The angle by which a robot turns from `yaw`, until |error_at(yaw)| < `near`."""
    angle, swings, side = 0.0, 0, 0.0
    for _ in range(MOST_STEPS):
        error = error_at(yaw + angle)
        if abs(error) <= near or swings > 4:
            return angle if abs(error) <= near else math.nan
        if abs(angle) > ENDLESS:
            return math.copysign(math.inf, angle)
        swings += side * error < 0.0
        side = math.copysign(1.0, error)
        angle += side * min(STEP, abs(error) - near + 1e-6)
    return math.nan


# The IMU lab ----------------------------------------------------------------------------------

@dataclass(frozen=True)
class Law:
    """The error of a turn by the IMU's heading, in degrees as the handout has it.

    `goal_wraps`, `error_wraps`: does the node wrap a value below the range, and one above it?
    `reading`: the heading that the node reads [deg], by the true one. `quarter`: the angle that it
    adds for a turn to the left. `command`: the error that it turns by, of (error, side).
    """

    mistake: str = ''
    goal_wraps: Tuple[bool, bool] = (True, True)
    error_wraps: Tuple[bool, bool] = (True, True)
    reading: Callable[[float], float] = unwrapped
    quarter: float = 90.0
    command: Callable[[float, float], float] = lambda error, side: error

    def goal(self, heading: float, side: float) -> float:
        """The goal of a turn from `heading`, both [deg]; `side`: 1 left, -1 right."""
        goal = self.reading(heading) + side * self.quarter
        goal += 360.0 * (self.goal_wraps[0] and goal < 0.0)
        return goal - 360.0 * (self.goal_wraps[1] and goal > 360.0)

    def error(self, goal: float, heading: float, side: float) -> float:
        """The error at a heading from 0 to 360, all [deg]."""
        error = goal - self.reading(heading)
        error += 360.0 * (self.error_wraps[0] and error < -180.0)
        error -= 360.0 * (self.error_wraps[1] and error > 180.0)
        return self.command(error, side)

    def turned(self, heading: float, side: float, near: float = NEAR_TURN) -> float:
        """The angle by which the robot turns from `heading`, both [rad]."""
        goal = self.goal(math.degrees(heading) % 360.0, side)
        return turned(lambda yaw: math.radians(self.error(goal, math.degrees(yaw) % 360.0, side)),
                      heading, near)


def signed(heading: float) -> float:
    """The heading from -180 to 180 [deg]."""
    return difference_degrees(heading, 0.0)


def by_letter(error: float, side: float) -> float:
    """The error of a node that turns to the letter's side, whatever the error's sign."""
    return abs(error) * side


LAWS = (
    Law(),
    Law(quarter=180.0),    # the lab is also given with half turns
    Law('error_not_wrapped', error_wraps=(False, False)),
    Law('error_not_wrapped_low', error_wraps=(False, True)),
    Law('error_not_wrapped_high', error_wraps=(True, False)),
    Law('nothing_wrapped', (False, False), (False, False)),
    Law('nothing_wrapped', (False, False), (False, False), reading=signed),
    Law('goal_not_wrapped_low', (False, True), (False, False), command=by_letter),
    Law('goal_not_wrapped_high', (True, False), (False, False), command=by_letter),
    Law('no_negative_clamp', command=lambda error, side: abs(error)),
    # not read, in radians, or by numbers in another order, which may also mirror it
    Law('heading_kept', reading=lambda heading: 0.0),
    Law('heading_kept', reading=lambda heading: math.radians(signed(heading)) % 360.0),
    Law('radians', quarter=math.pi / 2.0),
    Law('swapped', quarter=-90.0),
    Law('quaternion_order', reading=lambda heading: (180.0 - heading) % 360.0))


# The Transformation lab -----------------------------------------------------------------------

def in_radians(yaw: float) -> float:
    """The yaw of a node that has degrees where it needs radians."""
    return math.degrees(wrap(yaw))


def mirrored(yaw: float) -> float:
    """The yaw that numbers of a quaternion give in another order."""
    return math.pi - yaw


class Declared(NamedTuple):
    """A reset: the robot in ``odom`` and the IMU's yaw at it, and the pose that was declared."""

    odom: Pose2
    imu: float
    pose: Pose2 = Pose2()


class Drive(NamedTuple):
    """A drive: turn, straight on, turn."""

    first_turn: float    # [rad]
    way: float           # [m]; infinite: without an end; NaN: it is chance whether it begins
    last_turn: float     # [rad]


def after(declared: Pose2, since: Pose2) -> Pose2:
    """The pose in ``local`` after a motion `since` the declared pose; its yaw is not wrapped."""
    x, y = declared.act((since.x, since.y))
    return Pose2(float(x), float(y), since.yaw + declared.yaw)


def lost(declared: Pose2, since: Pose2) -> Pose2:
    """The pose of a node that forgets the declared one."""
    return since


def not_rotated(declared: Pose2, since: Pose2) -> Pose2:
    """The pose of a node that adds the displacement as it is."""
    return Pose2(declared.x + since.x, declared.y + since.y, declared.yaw + since.yaw)


@dataclass(frozen=True)
class Way:
    """One way in which a node computes its pose in ``local``.

    `theta`: the angle of R(theta)^-1, by the reference for it. `kept`: the references that a reset
    does not forget (place, rotation, heading). `declared`: the pose in ``local``, of (the declared
    one, the pose since). `believed`: the pose that the node drives by, of (the odometry's pose, the
    IMU's yaw, the pose in ``local``). `reading`: see Law; in [rad] here.
    """

    mistake: str = ''
    theta: Callable[[Declared], float] = lambda reference: reference.odom.yaw
    kept: Tuple[str, ...] = ()
    declared: Callable[[Pose2, Pose2], Pose2] = after
    believed: Callable[[Pose2, float, Pose2], Pose2] = lambda odom, imu, local: local
    reading: Callable[[float], float] = unwrapped
    wraps: Callable[[float], float] = wrap
    wraps_heading: Callable[[float], float] = wrap

    def pose(self, odom: Pose2, imu: float, last: Declared, start: Declared) -> Pose2:
        """The believed pose, by the pose in ``odom`` and the IMU's yaw. `last`: the last reset;
        `start`: the references at the node's start, as a reset."""
        place, rotation, heading = (start if part in self.kept else last
                                    for part in ('place', 'rotation', 'heading'))
        x, y = rotation_matrix(-self.theta(rotation)) @ (
            odom.x - place.odom.x, odom.y - place.odom.y)
        yaw = self.wraps_heading(self.reading(imu) - self.reading(heading.imu))
        local = self.declared(last.pose, Pose2(float(x), float(y), yaw))
        return self.believed(odom, imu, Pose2(local.x, local.y, self.wraps_heading(local.yaw)))

    def drive(self, begin: Pose2, last: Declared, start: Declared, goal: Pose2,
              near: float = NEAR) -> Drive:
        """The Drive from `begin` in ``odom`` to `goal` in ``local``; `last`, `start`: see `pose`.
        The difference of the IMU's yaw and the odometry's is that of the last reset."""
        def here(place, yaw):
            return self.pose(Pose2(*place, yaw), wrap(yaw + last.imu - last.odom.yaw), last, start)

        def off_course(yaw):
            pose = here((begin.x, begin.y), yaw)
            return self.wraps(pose.bearing_to(goal) - pose.yaw)

        first = turned(off_course, begin.yaw, near)
        if not math.isfinite(first):
            leaps = math.isnan(first) and self.reading is in_radians
            return Drive(first, math.nan if leaps else 0.0, 0.0)
        yaw = begin.yaw + first
        faced = here((begin.x, begin.y), yaw)
        one_on = here((begin.x + math.cos(yaw), begin.y + math.sin(yaw)), yaw)
        way = reach((goal.x - faced.x, goal.y - faced.y), (one_on.x - faced.x, one_on.y - faced.y))
        if math.isinf(way):
            return Drive(first, way, 0.0)
        end = begin.x + way * math.cos(yaw), begin.y + way * math.sin(yaw)
        return Drive(first, way, turned(
            lambda angle: self.wraps(goal.yaw - here(end, angle).yaw), yaw, near))


def reach(goal: Tuple[float, float], step: Tuple[float, float]) -> float:
    """The way [m] after which a robot that moves by `step` in each metre is NEAR_PLACE from `goal`;
    infinite if it passes by. Closed form: the first zero of a polynomial of degree 2."""
    along = goal[0] * step[0] + goal[1] * step[1]
    inside = along ** 2 - (goal[0] ** 2 + goal[1] ** 2 - NEAR_PLACE ** 2)
    if math.hypot(*goal) <= NEAR_PLACE:
        return 0.0
    return along - math.sqrt(inside) if inside >= 0.0 and along > 0.0 else math.inf


WAYS = (
    Way(),
    Way('inverse_missing', lambda reference: -reference.odom.yaw),
    Way('not_rotated', lambda reference: 0.0),
    Way('imu_rotates', lambda reference: reference.imu),
    Way('reference_kept', kept=('place', 'rotation', 'heading')),
    Way('yaw_kept', kept=('rotation', 'heading')),
    Way('yaw_kept', kept=('rotation',)),
    Way('yaw_kept', kept=('heading',)),
    Way('place_kept', kept=('place',)),
    Way('place_kept', kept=('place', 'rotation')),
    Way('declared_lost', declared=lost),
    Way('declared_lost', declared=not_rotated),
    Way('no_local_frame', believed=lambda odom, imu, local: Pose2(odom.x, odom.y, wrap(odom.yaw))),
    Way('no_local_frame', believed=lambda odom, imu, local: Pose2(odom.x, odom.y, imu)),
    Way('no_local_frame', believed=lambda odom, imu, local: Pose2(odom.x, odom.y, local.yaw)),
    Way('no_local_frame', believed=lambda odom, imu, local: Pose2(local.x, local.y, imu)),
    Way('no_local_frame', believed=lambda odom, imu, local: Pose2(
        local.x, local.y, wrap(odom.yaw))),
    Way('error_not_wrapped', wraps=unwrapped),
    Way('error_not_wrapped', wraps=unwrapped, wraps_heading=unwrapped),
    Way('quaternion_order', reading=lambda yaw: 0.0),
    Way('quaternion_order', reading=mirrored),
    Way('quaternion_order', lambda reference: mirrored(reference.odom.yaw), reading=mirrored),
    Way('quaternion_order', lambda reference: 0.0, reading=mirrored),
    Way('quaternion_order', lambda reference: mirrored(reference.odom.yaw)),
    Way('quaternion_order', lambda reference: math.pi),
    Way('degrees', reading=in_radians))
