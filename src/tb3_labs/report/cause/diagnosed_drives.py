"""The drives of a recorded run, compared with those of mistaken robots.

Only a drive from a state of the node that is known is compared: the first one after a reset, or
after the node's start. It is taken as three parts: a turn, a straight way, a turn.

Units: metres, radians, seconds since the recording's start; poses in ``odom``, with a continuous
yaw. A distance between two drives is in metres: a turn by another angle counts as the way by which
the robot is then off its course.
"""
import math
import re
from typing import Iterator, List, NamedTuple, Sequence, Tuple

import numpy as np

from tb3_labs.geometry.angles import wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.report.cause.mistakes import NEAR_GOAL, NEAR_PLACE, Declared, Drive, Way
from tb3_labs.report.motion.movements import NO_SPEED, Movement, cuts, has_control, moving
from tb3_labs.report.run_data import Poses, RunData, Samples
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT

#: A node may end a turn at this part of the handout's tolerance; its robot comes nearer in steps.
CLOSE = 0.5
#: A long way ends at a far goal only if the turn before it ended at this part of the tolerance.
EXACT = 0.1
#: The distance of a drive that has another course [m].
UNLIKE = 2.0
#: A turn on the spot, and the last turn, count as a way of LEAST_LEVER; a first turn as the way
#: that follows, from LEAST_LEVER to FARTHEST [m].
LEAST_LEVER, FARTHEST = 0.3, 1.0
#: A robot may miss a goal farther than this, since the error of its first turn is chance [m].
MISSES = 1.0
#: A robot rests this long after its last command [s].
SETTLED = 0.6
#: A right drive ends within ARRIVED and FACES_WITHIN of its goal [m], [rad], and at most
#: BEYOND_GOAL behind it [m]; each of its turns is at most half a turn and ROUND more [rad].
ARRIVED, BEYOND_GOAL, FACES_WITHIN, ROUND = 0.19, 0.06, math.radians(7.0), 0.5
#: An endless turn was ended by a person, after more than this [rad].
LONG_TURN = math.radians(120.0)
#: A turn goes left and right if the side changes this often.
SWINGS = 5
#: A drive was cut off if control, a reset or the recording's end came within this of its end [s].
CUT = 0.5
#: A drive that is not followed by its node's line within this time may have been cut off, too [s].
SAID = 1.0
#: The line of a node that has reached its goal.
REACHED_WORDS = re.compile('goal reached', re.IGNORECASE)
#: The robot stood if odometry and IMU show at most this [m], [rad].
STOOD, STOOD_TURN = 0.05, 0.15
#: After a longer silence of a sensor, a right node may drive wrongly [s].
LOST_BY = 0.5
#: The ghost of each part of a drive has this many poses.
PARTS_OF_DRIVE = 20


class Seen(NamedTuple):
    """A recorded drive. `ended`: the part that was cut off, first, way or last; '' for none."""

    times: Tuple[float, float, float, float]    # start, start and end of the way, end
    start: Pose2
    drive: Drive
    ended: str
    end: Pose2


#: A drive from a known state: the drive, the last reset before it, the node's start.
Fresh = Tuple[Seen, Declared, Declared]


class Fit(NamedTuple):
    """A run compared with one way of making a mistake: the distance of each movement, in order,
    and the Drives of the mistaken robot (for turns there are none)."""

    mistake: str
    apart: Sequence[float]
    ideals: Sequence[Drive] = ()


def compared(fresh: Sequence[Fresh], goal: Pose2, way: Way) -> Fit:
    """Returns the Fit of the drives and a `way`, in metres; `goal`: in ``local``."""
    far: List[float] = []
    ideals: List[Drive] = []
    for seen, last, first in fresh:
        tried = [way.drive(seen.start, last, first, goal, near)
                 for near in (NEAR_GOAL, CLOSE * NEAR_GOAL, EXACT * NEAR_GOAL)]
        distance, ideal = min(((apart(seen, drive), drive) for drive in tried),
                              key=lambda pair: pair[0])
        far.append(0.0 if not way.mistake and _arrived(seen, last, goal) else distance)
        ideals.append(ideal)
    if any(way.leaps and not apart for apart in far):   # in another drive it may begin by chance
        far = [0.0 if math.isnan(ideal.way) else apart for apart, ideal in zip(far, ideals)]
    return Fit(way.mistake, far, ideals)


def ghost(seen: Sequence[Seen], ideals: Sequence[Drive]) -> Poses:
    """Returns the poses of a mistaken robot; each part of a drive takes the time that it took."""
    paths = []
    for each, ideal in zip(seen, ideals):
        x, y, yaw = each.start.x, each.start.y, each.start.yaw
        way = ideal.way if math.isfinite(ideal.way) else each.drive.way
        rows: List[Tuple[float, float, float, float]] = []
        parts = [(ideal.first_turn, 0.0), (0.0, way), (ideal.last_turn, 0.0)]
        for (turn, ahead), begin, end in zip(parts, each.times, each.times[1:]):
            turn = turn if math.isfinite(turn) else 0.0
            time = np.linspace(begin, max(begin, end), PARTS_OF_DRIVE)
            share = np.linspace(0.0, 1.0, PARTS_OF_DRIVE)
            rows += zip(time, x + share * ahead * math.cos(yaw),
                        y + share * ahead * math.sin(yaw), yaw + share * turn)
            x, y, yaw = rows[-1][1:]
        time, *pose = np.array(rows).T
        paths.append(Poses(time, time, *pose))
    return Poses.joined(paths)


def fresh_drives(run: RunData, found: Sequence[Movement]) -> Iterator[Fresh]:
    """Yields each drive among the movements `found` that begins from a known state: the robot
    stood from the reset, or from the recording's start, to the drive, and no sensor was lost."""
    said = said_reached(run)
    ends = np.concatenate([cuts(run), [run.duration], [
        movement.end for movement in found
        if len(run.log) and not (np.abs(said - movement.end) < SAID).any()]])
    starts = [_declared(run, time, Pose2()) for time in run.starts or run.odometry.time[:1]]
    declared = starts + [_declared(run, time, run.resets.pose(k))
                         for k, time in enumerate(run.resets.time)]
    declared.sort(key=lambda reset: reset.time)
    for movement in found:
        if not has_control(run, (movement.begin + movement.end) / 2.0):
            continue
        first, last = _latest(starts, movement.begin), _latest(declared, movement.begin)
        if _stood(run, last.time, movement.begin) and not any(
                was_lost(sensor, last.time, movement.end) for sensor in (run.imu, run.odometry)):
            yield seen_drive(run, movement, ends), last, first


def _latest(resets: Sequence[Declared], time: float) -> Declared:
    """The last of these resets until a time [s]; the first one if there is none."""
    return ([*resets[:1]] + [each for each in resets if each.time <= time])[-1]


def said_reached(run: RunData) -> np.ndarray:
    """The times at which a node said that it reached its goal [s]."""
    return run.log.time[[bool(REACHED_WORDS.search(text)) for text in run.log.texts]]


def _stood(run: RunData, begin: float, end: float) -> bool:
    """Did the robot stand from `begin` to `end` [s]?"""
    place, yaws = run.odometry.between(begin, end), np.unwrap(run.imu.between(begin, end).yaw)
    return not len(place) or not len(yaws) or bool(
        max(np.ptp(place.x), np.ptp(place.y)) < STOOD and np.ptp(yaws) < STOOD_TURN)


def was_lost(sensor: Samples, begin: float, end: float) -> bool:
    """Was a sensor silent for long, or set to other values, between `begin` and `end` [s]?"""
    part = sensor.between(begin, end)
    return bool(np.diff([begin, *part.time, end]).max() > LOST_BY) or (
        isinstance(part, Poses) and len(part.leaps) > 0)


def _declared(run: RunData, time: float, pose: Pose2) -> Declared:
    return Declared(_odom(run, time), wrap(float(run.imu.yaw_at(time))), pose, float(time))


def _odom(run: RunData, time: float) -> Pose2:
    """The pose in ``odom``, with a continuous yaw."""
    place = run.odometry.at(time)
    return Pose2(place.x, place.y, float(run.odometry.yaw_at(time)))


def seen_drive(run: RunData, movement: Movement, ends: np.ndarray) -> Seen:
    """Returns a movement as it was; `ends`: the times at which one may be cut off [s]. A robot goes
    on a moment after its last command. Without a way, the last turn begins where the side
    changes, if it changes once."""
    begin, forward, again, stop = (
        movement.begin, movement.forward, movement.turns_again, movement.end)
    has_way = forward < again
    if not has_way:
        changes = side_changes(run, begin, stop)
        forward = again = float(changes[0]) if len(changes) == 1 else stop + SETTLED
    later = run.commands.time[(run.commands.time > stop) & moving(run.commands)]
    rest = min([stop + SETTLED, run.duration, *later[:1]])
    at_begin, ahead, end = (_odom(run, time) for time in (begin, min(forward, rest), rest))
    first = math.nan if swings(run, begin, forward) else ahead.yaw - at_begin.yaw
    last = math.nan if swings(run, again, stop) else end.yaw - ahead.yaw
    way = 0.0
    if has_way:
        way = (end.x - at_begin.x) * math.cos(ahead.yaw) + (
            end.y - at_begin.y) * math.sin(ahead.yaw)
    part = 'last' if again < stop - COMMAND_TIMEOUT else 'way' if has_way else 'first'
    was_cut = (np.abs(ends - stop) < CUT).any()
    return Seen((begin, forward, again, stop), at_begin, Drive(first, way, last),
                part if was_cut else '', end)


def side_changes(run: RunData, begin: float, end: float) -> np.ndarray:
    """The times at which the commands change the side of a turn [s]."""
    commands = run.commands.between(begin, end)
    turning = commands.take(np.abs(commands.angular) > NO_SPEED)
    return turning.time[1:][np.diff(np.sign(turning.angular)) != 0.0]


def swings(run: RunData, begin: float, end: float) -> bool:
    """Was the robot told to turn left and right, again and again?"""
    return len(side_changes(run, begin, end)) >= SWINGS


def _arrived(seen: Seen, last: Declared, goal: Pose2) -> bool:
    """Did the robot end at the goal of a right node, the short way round?"""
    if seen.ended or not seen.drive.way:
        return False
    here = Way().pose(seen.end, wrap(seen.end.yaw + last.imu - last.odom.yaw), last, last)
    course = here.yaw - seen.drive.last_turn
    beyond = (here.x - goal.x) * math.cos(course) + (here.y - goal.y) * math.sin(course)
    return (here.distance_to(goal) <= ARRIVED and beyond <= BEYOND_GOAL
            and abs(wrap(here.yaw - goal.yaw)) <= FACES_WITHIN
            and max(abs(seen.drive.first_turn), abs(seen.drive.last_turn)) <= math.pi + ROUND)


def apart(seen: Seen, ideal: Drive) -> float:
    """The distance of a drive from an ideal one [m]."""
    was = seen.drive
    if math.isnan(ideal.way):
        return 0.0 if math.isnan(was.first_turn) else UNLIKE
    if not was.way:
        return _only_turned_apart(seen, ideal)
    if math.isnan(was.first_turn) or not math.isfinite(ideal.first_turn):
        return UNLIKE
    course = abs(was.first_turn - ideal.first_turn)
    lever = min(max(abs(was.way), LEAST_LEVER), FARTHEST)
    far = (2.0 * math.sin(min(course, math.pi) / 2.0) * lever
           + LEAST_LEVER * (course > math.pi))
    if seen.ended == 'way':
        end = ideal.way if ideal.way < MISSES else math.inf
        return max(far, was.way - end - NEAR_PLACE, -was.way)
    if math.isinf(ideal.way):
        return UNLIKE
    far = max(far, 2.0 * (ideal.way - was.way), 2.0 * (was.way - ideal.way - NEAR_PLACE))
    if seen.ended == 'last' or math.isnan(was.last_turn):
        return max(far, LEAST_LEVER * turn_apart(was.last_turn, ideal.last_turn, True))
    return max(far, LEAST_LEVER * turn_apart(
        was.first_turn + was.last_turn, ideal.first_turn + ideal.last_turn, False))


def _only_turned_apart(seen: Seen, ideal: Drive) -> float:
    """The distance of a drive that only turned from an ideal one [m]."""
    was, was_cut = seen.drive, bool(seen.ended)
    if was.last_turn and ideal.way == 0.0 and math.isfinite(ideal.first_turn):
        return LEAST_LEVER * max(abs(was.first_turn - ideal.first_turn),
                                 turn_apart(was.last_turn, ideal.last_turn, was_cut))
    if was.last_turn or (
            ideal.way and math.isfinite(ideal.first_turn) and not was_cut):
        return UNLIKE
    angle = ideal.first_turn + (ideal.last_turn if ideal.way == 0.0 else 0.0)
    return LEAST_LEVER * turn_apart(was.first_turn, angle, was_cut)


def turn_apart(was: float, ideal: float, was_cut: bool) -> float:
    """The distance of a turn from an ideal one [rad]; UNLIKE / LEAST_LEVER for turns of
    different kinds. A turn that goes left and right is NaN."""
    if math.isnan(was) or math.isnan(ideal):
        return 0.0 if math.isnan(was) and math.isnan(ideal) else UNLIKE / LEAST_LEVER
    if math.isfinite(ideal):
        if was_cut and was * ideal >= 0.0:
            return max(0.0, abs(was) - abs(ideal))
        return abs(was - ideal)
    if not was_cut:
        return UNLIKE / LEAST_LEVER
    return 0.0 if was * ideal > 0.0 and abs(was) > LONG_TURN else UNLIKE / LEAST_LEVER
