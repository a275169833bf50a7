"""Drives to a goal in a local frame: where they ended, and how the robot faced there."""
import math

from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.observation import MOVED, RESTED, Observation, Scene

#: Keys of a drive's facts: the goal in the local frame, [x, y, yaw] in [m], [rad]; the transform
#: from the robot's true frame to the local frame, the same three numbers.
GOAL_POSE = 'goal'
LOCAL_T_WORLD = 'local_T_world'
#: The handout's goal: x, y [m], heading [rad].
GOAL = (-0.61, 0.61, 0.0)
#: The handout's tolerances [m], [rad], [deg]; how far a robot may go on after it was stopped [m],
#: [deg].
DISTANCE, ANGLE_RAD = 0.15, 0.05
ANGLE = math.degrees(ANGLE_RAD)
MORE_DISTANCE, MORE_ANGLE = 0.02, 2.0
#: The tolerances beyond the handout [m], [deg].
EXACT_DISTANCE, EXACT_ANGLE = 0.02, 1.0
#: A drive begins within this time after control was given, and takes no longer than this [s].
REACTION, DRIVE_TIME = 4.0, 50.0
#: It goes no farther away than this [m].
ASTRAY = 3.0
#: What place and heading are judged by, in words.
PLACE_LIMITS = 'within {:g} m, and {:g} that a stopped robot goes on; begun within {:g} s, over ' \
    'within {:g} s, never {:g} m away'.format(
        DISTANCE, MORE_DISTANCE, REACTION, DRIVE_TIME, ASTRAY)
HEADING_LIMITS = 'within {:g} rad ({:.1f} degrees), and {:g} degrees that a stopped robot goes ' \
    'on'.format(ANGLE_RAD, ANGLE, MORE_ANGLE)


def place(seen: Observation, name: str, tolerance: float = DISTANCE + MORE_DISTANCE) -> str:
    """'' if the drive `name` ended at most `tolerance` [m] from the goal, else what was seen."""
    scene = seen.during(name)
    missed = not_driven(scene)
    if missed:
        return missed
    away = _end(scene).distance_to(Pose2(*GOAL))
    if not scene.facts[RESTED]:
        return 'it was still moving after {:.0f} s, {:.2f} m from the goal'.format(
            scene.end - scene.begin, away)
    return '' if away <= tolerance else 'it stopped {:.2f} m from the goal'.format(away)


def heading(seen: Observation, name: str, tolerance: float = ANGLE + MORE_ANGLE) -> str:
    """'' if the robot at last faced the goal's heading within `tolerance` [deg], else what it
    faced."""
    scene = seen.during(name)
    missed = not_driven(scene)
    if missed:
        return missed
    if not scene.facts[RESTED]:
        return 'it was still moving after {:.0f} s'.format(scene.end - scene.begin)
    faced = math.degrees(difference(_end(scene).yaw, GOAL[2]))
    return '' if abs(faced) <= tolerance else \
        'at the end it faced {:.1f} degrees instead of 0'.format(faced)


def not_driven(scene: Scene) -> str:
    """'' if the node moved the robot after it had got control."""
    return '' if scene.facts[MOVED] else 'it got control, but did not move the robot'


def _end(scene):
    """The pose in the local frame in which a drive ended."""
    return Pose2(*scene.facts[LOCAL_T_WORLD]) @ Pose2(*scene.truth[-1, 1:])
