"""The mistake of a node that turns wrongly, and remarks on mistakes that cost no points."""
from typing import List, Sequence, Tuple

import numpy as np

from tb3_labs.geometry.angle_arrays import wrap_all
from tb3_labs.marking.labs.criteria import ANGULAR, RARELY, seldom
from tb3_labs.marking.labs.turn import (
    AFTER_STOP, COUNTS_DOWN, EACH_TURN, LAW, LEFT, MAX_ANG_Z, NONSENSE, NO_CLIENT, RIGHT,
    START, TOLERANCE, TO_RIGHT, TYPED_NONSENSE, WatchedTurn, upward)
from tb3_labs.marking.trial.observation import RESTED, Observation, Scene
from tb3_labs.marking.trial.printed import LONGEST_LINE

#: A place to look at if a node has a wrong heading.
ITS_HEADING = 'Print self.curr_yaw, and turn the robot once around by hand: it should run from 0 ' \
    'to 360. If it stands still: is it stored in self.curr_yaw, is it the third Euler angle, is ' \
    'the order of the four numbers w, x, y, z? If it ends at 6.28, it is in radians; far beyond ' \
    '360, it was converted to degrees twice; if it comes late, there is a sleep in callback_imu.'
#: Near to an angle [deg]. A robot that turns away from its goal comes at least AWAY far [deg]. A
#: node whose turn is over at once sends at most FEW zeros.
NEARLY, AWAY, FEW = 15.0, 45.0, 5
NO_RIGHT = 'A turn to the right is over at once, one to the left is not: is there a branch for ' \
    'r, as for l? Any negative error is less than HDG_TOL (abs).'


def hint(seen: Observation) -> str:
    """The mistake of a node that turns wrongly; '' if it is not known."""
    each_turn = _tried(seen)
    turns = [(turn, scene) for turn, scene in each_turn if len(scene.moving)]
    words = _why_no_turn(each_turn) if len(turns) < len(each_turn) else ''
    if turns and not words:
        words = _why_wrong(turns)
    return words and '{} See {}.'.format(words, TO_RIGHT if words == NO_RIGHT else LAW)


def last_hint(seen: Observation) -> str:
    """The questions on its heading, for a node that turns wrongly to both sides; else ''."""
    wrong = {turn.typed for turn, scene in _tried(seen)
             if len(scene.moving) and _is_wrong(turn, scene)}
    return '{} See {}.'.format(ITS_HEADING, START) if len(wrong) > 1 else ''


def remarks_on_turns(seen: Observation, parts: Sequence[str] = ()) -> List[str]:
    """Sentences on mistakes that cost nothing."""
    printed = [seen.during(name, may_die=True).printed.splitlines()[1:]
               for name in (LEFT, NONSENSE) if seen.has(name)]
    prompts_alone = len(printed) > 1 and len(printed[1]) == 1 and printed[0][-1:] == printed[1]
    pause = seldom(scene for _, scene in _tried(seen) if len(scene.moving))
    return ['After "{}" it printed its prompt alone, and no error. See {}.'.format(
        TYPED_NONSENSE, TO_RIGHT)] * prompts_alone + [
            'Its commands come every {:.1f} s, and not ten times a second: is there a sleep? See '
            '{}.'.format(pause, LAW)] * (pause > 0.0) + [
                NO_CLIENT] * (upward(seen) < 0.0) + [COUNTS_DOWN] * (seen.mouse_up < 0)


def _tried(seen: Observation) -> List[Tuple[WatchedTurn, Scene]]:
    return [(turn, seen.during(name, may_die=True)) for name, turn in EACH_TURN.items()
            if seen.has(name)]


def _is_wrong(turn, scene):
    """Did the robot miss the goal of a turn, or go on?"""
    return not scene.facts[RESTED] or (
        abs(scene.turned_deg - turn.asked_deg) > TOLERANCE + AFTER_STOP)


def _why_no_turn(tried):
    """The mistake of turns of which some did not begin."""
    still = [(turn, scene) for turn, scene in tried if not len(scene.moving)]
    if all(scene.run.printed.startswith(turn.typed) for turn, scene in still):
        return 'It had not asked for a letter after {:.0f} s: is there a Timer, and how often ' \
            'does it call callback_controller? Duration(.1) is ten times a second, Duration(10) ' \
            'is every 10 s.'.format(max(scene.end - scene.run.begin for _, scene in still))
    if not all(len(scene.commands) for _, scene in still) or any(scene.odd for _, scene in tried):
        return ''
    answers = [scene.printed.splitlines()[1:-1] for _, scene in still]
    if all(answers):        # between the letter and the prompt
        return '{} is answered by {!r}: with what is the letter compared?'.format(
            still[0][0].typed, answers[0][0][:LONGEST_LINE])
    if len(still) == len(tried):
        return 'Its commands go on, all of them zero: which field of the Twist turns the robot, ' \
            'and is it set?' if min(len(scene.commands) for _, scene in still) > FEW else \
            'Its turn is over at once: is self.turning True after the letter, and is the angle ' \
            'that it adds in degrees, as HDG_TOL is?'
    runs = [scene.run.begin for _, scene in tried]
    if [len(scene.moving) > 0 for _, scene in tried] == [
            begin not in runs[:k] for k, begin in enumerate(runs)]:
        return 'Only zeros followed its first turn: does turning become False at the goal, so ' \
            'that the next letter is read?'
    rights = [scene for turn, scene in tried if turn.typed == RIGHT]
    return NO_RIGHT if rights and not any(len(scene.moving) for scene in rights) else ''


def _why_wrong(turns):
    """The mistake of turns that began, the first that fits."""
    if not any(scene.moving[:, ANGULAR].any() for _, scene in turns):
        return 'It commands linear.x alone, and no angular.z: which of them turns the robot?'
    pause = seldom(scene for _, scene in turns)
    if pause:
        return 'Its commands come every {:.1f} s: is there a sleep in callback_controller, or is ' \
            'its Timer as slow? The robot turns by up to {:.0f} degrees meanwhile.'.format(
                pause, np.degrees(pause * MAX_ANG_Z))
    wrong = [each for each in turns if _is_wrong(*each)]
    if not wrong:
        return ''
    if all(len(scene.commands) and scene.commands[-1, ANGULAR]
           and scene.end - scene.commands[-1, 0] > RARELY for _, scene in wrong):
        return 'No zero follows its last command: which message shall be the last one of a turn?'
    return _where_it_ends(turns) or _which_way(wrong)


def _which_way(wrong):
    """The mistake that the beginnings and the ends of wrong turns show; '' if none."""
    asked, turned = np.array([(turn.asked_deg, scene.turned_deg) for turn, scene in wrong]).T
    restless = sum(not scene.facts[RESTED] for _, scene in wrong)
    if all(scene.moving[0, ANGULAR] * turn.asked_deg < 0.0 for turn, scene in wrong):
        if restless > 1 and (turned * np.sign(asked) < -AWAY).all():
            return 'It turns away from the goal, and comes to no rest. Turn it to the left by ' \
                'hand: if self.curr_yaw grows, is the error goal minus heading, and K_HDG ' \
                'positive? If it falls, step 4 has the heading.'
        if len(wrong) > 1 and (np.abs(np.abs(turned) - np.abs(asked)) < NEARLY).all():
            return 'It turns to the other side: to the left the heading grows, to the right it ' \
                'falls.'
    return 'It comes to its goal, and goes on to and fro: is HDG_TOL 10, and the turn over ' \
        'within it?' if restless and (np.abs(turned - asked) < 2.0 * NEARLY).all() else ''


def _where_it_ends(turns):
    """The mistake that the headings at the ends of turns show, and the angles; '' if none."""
    if len(turns) < 3 or not all(scene.facts[RESTED] for _, scene in turns):
        return ''
    ends, asked, turned, slip = np.array([
        (turn.begins_deg + scene.turned_deg, turn.asked_deg, scene.turned_deg, turn.slip)
        for turn, scene in turns]).T
    ends = np.degrees(wrap_all(np.radians(ends)))
    if np.ptp(np.abs(turned) / (1.0 - slip)) < np.ptp(np.abs(turned)) / 3.0:
        return 'It turns by {:.0f} degrees, and by {:.0f} where the wheels slip: does a turn end ' \
            'by self.curr_yaw, or after a time?'.format(*(
                np.abs(turned)[each].mean() for each in (slip == 0.0, slip > 0.0)))
    if (np.abs(ends) < NEARLY).all():
        return 'Each turn ends at the heading 0, which self.goal_yaw has from the beginning: is ' \
            'the goal of the letter stored in self.goal_yaw?'
    if (np.abs(ends - asked) < NEARLY).all():
        return 'Each l ends at the heading 90, each r at 270, wherever it began: does the goal ' \
            'count from self.curr_yaw?'
    mean = np.abs(turned).mean()
    is_half = abs(mean - 180.0) < NEARLY       # its side is chance
    if np.ptp(np.abs(turned)) > NEARLY or abs(mean - 90.0) < NEARLY or not np.ptp(slip) or (
            not is_half and (turned * asked < 0.0).any()):      # all alike, also after a fixed time
        return ''
    return 'Each turn is one of {:.0f} degrees: which angle does a letter add to self.curr_yaw{}' \
        '?'.format(mean, ', and is HDG_TOL 10' if mean < 90.0 else '')
