"""The sentences of a page: what was found, by which rule, in which frame."""
import math
from typing import List, Sequence

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.report.movements import FASTEST_BY_MOUSE, PAUSE, Kind, movements
from tb3_labs.report.run_data import RunData
from tb3_labs.report.tables import number
from tb3_labs.report.turns import TurnReport

NOTHING = 'No drives are listed: {}. The local frame is {}.'
NO_COMMANDS = 'the recording holds neither goal_state nor commands; record /cmd_vel too'
NO_DRIVE = 'neither goal_state nor the commands show one'
#: How turns and drives are told from movements by hand.
BY_CONTROL = ('By the commands and ctrl_relinq: each movement while a node had control is a '
              'drive, any other is by hand.')
PAD_ALONE = ('A gamepad (joy) was recorded, but it never gave control (ctrl_relinq): all movements '
             'count as by hand.')
WITH_MOUSE = ('By the commands: a turn has no forward speed, from rest to rest, and is faster '
              'than any by the mouse ({:g} rad/s); all else is by hand.'.format(FASTEST_BY_MOUSE))
BY_SHAPE = ('By the commands: a turn has no forward speed, from rest to rest; a drive is a '
            'turn, a straight line and a turn, with pauses under {:g} s; all else is by '
            'hand.'.format(PAUSE))


def nothing(run: RunData) -> str:
    """Why no drives are listed."""
    recorded = len(run.local_pose) and 'local_pose' not in run.derived
    words = NOTHING.format(
        NO_DRIVE if len(run.states) or len(run.commands) else NO_COMMANDS,
        'the recorded one' if recorded else declared(run))
    return words if len(run.states) or not len(run.commands) else words + ' ' + _rule(run)


def declared(run: RunData) -> str:
    """Where ``local`` was declared, for a run that did not record it."""
    words = ['taken as declared (0, 0, 0) at the first sample']
    for k, time in enumerate(run.resets.time):
        pose = run.resets.pose(k)
        words.append('({:.2f} m, {:.2f} m, {:.1f} deg) at {:.1f} s'.format(
            *(round(value, 3) + 0.0 for value in (pose.x, pose.y, math.degrees(pose.yaw))), time))
    return ', then '.join(words)


def of_drives(run: RunData) -> str:
    """How the drives of a run were found, if goal_state was not recorded."""
    words = []
    if 'states' in run.derived:
        words.append(_rule(run))
    if 'goals' in run.derived:
        goal = run.goals.pose(0)
        words.append('Goal: taken as ({:g} m, {:g} m, {:g} deg), see --goal.'.format(
            goal.x, goal.y, round(math.degrees(goal.yaw), 3) + 0.0))
    if 'local_pose' in run.derived:
        words.append('The local frame is {}; the place in it is that of the odometry, the heading '
                     'that of the IMU.'.format(declared(run)))
    return ' '.join(words)


def of_turns(run: RunData, reports: Sequence[TurnReport]) -> str:
    """How the turns of a run were found."""
    words = [_rule(run)] if 'states' not in run.derived else []
    if not all(turn.was_said for turn in reports):
        words.append('Asked: taken as the nearest multiple of 90 degrees{}.'.format(
            ' where topic turn said nothing' if len(run.asked) else ''))
    return ' '.join(words)


def unlisted(run: RunData, reports: Sequence[TurnReport]) -> str:
    """The movements that are neither a turn nor a drive; '' if there are none, or goal_state tells.
    """
    if len(run.states) and 'states' not in run.derived:
        return ''
    others: List[float] = []
    for movement in movements(run):
        listed = any(movement.begin < turn.end and turn.begin < movement.end for turn in reports)
        if not listed and movement.kind is not Kind.DRIVE:
            others.append(movement.end - movement.begin)
    if not others:
        return ''
    return 'Not listed: {} other movement{}, {} s in all.'.format(
        len(others), '' if len(others) == 1 else 's', number(sum(others), '{:.1f}'))


def _rule(run: RunData) -> str:
    if len(run.control):
        return BY_CONTROL
    if 'joy' in run.devices:
        return PAD_ALONE
    return WITH_MOUSE if 'mouse_info' in run.devices else BY_SHAPE
