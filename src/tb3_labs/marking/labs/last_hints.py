"""What to look at if nothing else explains a node, and remarks on mistakes that cost no points.

Only the check needs them: what it writes has them.
"""
import math
from typing import List

from tb3_labs.geometry.angles import wrap
from tb3_labs.marking.lab_names import MOVE2GOAL, TURN
from tb3_labs.marking.labs import move2goal, turn
from tb3_labs.marking.labs.criteria import LINEAR, STATES, seldom
from tb3_labs.marking.labs.turn import LEFT, NONSENSE, TYPED_NONSENSE
from tb3_labs.marking.trial.observation import MOVED, Observation

#: A place to look at if a node has a wrong heading.
ITS_HEADING = 'Print self.curr_yaw, and turn the robot once around by hand: it should run from 0 ' \
    'to 360. If it stands still: is it stored in self.curr_yaw, is it the third Euler angle, is ' \
    'the order of the four numbers w, x, y, z? If it ends at 6.28, it is in radians; far beyond ' \
    '360, it was converted to degrees twice; if it comes late, there is a sleep in callback_imu.'


def last_hint(seen: Observation) -> str:
    """The sentence for a node that lost points; '' if there is none."""
    return {TURN: _of_turns, MOVE2GOAL: _of_a_drive}.get(seen.lab, lambda seen: '')(seen)


def _of_turns(seen):
    """The questions on its heading, for a node that turns wrongly to both sides."""
    wrong = {each.typed for each, scene in turn.tried(seen)
             if len(scene.moving) and turn.is_wrong(each, scene)}
    return '{} See {}.'.format(ITS_HEADING, turn.START) if len(wrong) > 1 else ''


def _of_a_drive(seen):
    """What its first drive shows that missed the goal."""
    scene = seen.during(move2goal.FIRST_DRIVE)
    if not scene.facts[MOVED] or not move2goal.arrives(seen, move2goal.FIRST_DRIVE):
        return ''
    words, end = '', move2goal.end_of(scene)
    if seldom([scene]):
        words = 'Its commands come every {:.1f} s: is there a sleep, or is its Timer as ' \
            'slow?'.format(seldom([scene]))
    elif not scene.commands[:, LINEAR].any():
        words = 'It turned, and never drove forward: does the state become MOVE_FORWARD as soon ' \
            'as the error is small?'
    elif move2goal.REACHED.search(scene.printed):
        words = 'It said "Goal reached!" at ({:.2f}, {:.2f}), {:.0f} degrees of the local frame: ' \
            'is this its goal (self.goal_x, goal_y, goal_yaw), and are its distances and angles ' \
            'those of the law?'.format(end.x, end.y, math.degrees(wrap(end.yaw)))
    return words and '{} See {}.'.format(words, STATES)


def remarks_on_turns(seen: Observation) -> List[str]:
    """Sentences on mistakes that cost nothing."""
    printed = [seen.during(name, may_die=True).printed.splitlines()[1:]
               for name in (LEFT, NONSENSE) if seen.has(name)]
    prompts_alone = len(printed) > 1 and len(printed[1]) == 1 and printed[0][-1:] == printed[1]
    pause = seldom(scene for _, scene in turn.tried(seen) if len(scene.moving))
    return ['After "{}" it printed its prompt alone, and no error. See {}.'.format(
        TYPED_NONSENSE, turn.TO_RIGHT)] * prompts_alone + [
            'Its commands come every {:.1f} s, and not ten times a second: is there a sleep? See '
            '{}.'.format(pause, turn.LAW)] * (pause > 0.0)
