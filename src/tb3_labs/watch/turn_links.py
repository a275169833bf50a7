"""The chain of the IMU lab: heading -> curr_yaw -> goal_yaw -> turning -> command -> stop."""
from typing import List, Optional, Sequence, Tuple

import numpy as np

from tb3_labs.handout import HDG_TOL, K_HDG, MAX_ANG_Z, TURN_DEG
from tb3_labs.watch.broken_link import (
    LONGEST_COMMAND_GAP, BrokenLink, NodeRun, other_field_text, slow_rate_text)
from tb3_labs.watch.typed_turns import READ, Turn, heading, turns
from tb3_labs.watch.variables import Series, number, short

#: An angle is right within NEAR [deg]; an error is clear from CLEAR to 180 - CLEAR [deg].
NEAR, CLEAR = 3.0, 20.0
#: A finer tolerance than the handout's is reached in this time [s].
FINER = 2.5


def wrong_heading(node_run: NodeRun) -> Optional[BrokenLink]:
    """Is curr_yaw the heading, in a range that can be used?"""
    return node_run.cached(heading)[2]


def wrong_goal(node_run: NodeRun) -> Optional[BrokenLink]:
    """Is goal_yaw 90 degrees from curr_yaw after a letter, to its side?"""
    series, quantity, _ = node_run.cached(heading)
    goal, turning = node_run.find('goal_yaw'), node_run.flag('turning')
    right: Optional[Turn] = None
    if series is None or quantity is None or goal is None:
        return None
    unit = quantity.per_degree
    for turn in node_run.cached(turns):
        if turning is not None and turning.at(turn.begin) == 1.0:
            continue        # the letter is not read yet
        off = (number(turn.after) - turn.own) / unit - TURN_DEG * np.array(
            [turn.side] if turn.side else [1, -1])
        # a letter that is not recorded may be read at any moment until goal_yaw was
        turned = 0.0 if turn.side else (series.at(turn.begin + 2.0 * READ) - turn.own) / unit
        near = NEAR + abs(turned - 360.0 * round(turned / 360.0))
        if (np.abs(off - 360.0 * np.round(off / 360.0)) <= near).any():
            right = right or turn
            moved = turn.goal[turn.moving][-1:] - number(turn.after)
            if len(moved) and len(set(turn.goal[turn.moving])) > 5 and abs(moved[0]) > NEAR * unit:
                before = number(turn.after)
                return BrokenLink(
                    '{} went on from {:.4g} to {:.4g} in the turn after {}; it should stay'.format(
                        goal.name, before, moved[0] + before, turn.letter), turn.begin, goal.name)
            continue
        words = 'after {}, with {} {:.4g}, {} {} {}; it should be {}'.format(
            turn.letter, series.name, turn.own, goal.name,
            'stayed' if turn.before == turn.after else 'became', short(turn.after),
            '{:.4g}'.format((turn.own + turn.side * TURN_DEG * unit) % (360.0 * unit)) if turn.side
            else '{:g} more or less'.format(TURN_DEG * unit))
        begun = max([at for at in node_run.run.starts if at < turn.begin], default=turn.begin)
        printed = node_run.run.printed.arrival
        if unit < 0.5:
            words += f'. {series.name} is in radians here'
        elif turn.before == turn.after and begun < turn.begin and not (
                (begun < printed) & (printed < turn.begin)).any():
            words += f'. It had asked for nothing, {turn.begin - begun:.1f} s after its start'
        elif right:
            words += '; after {} with {:.4g} it was right{}'.format(
                right.letter, right.own, flag_differences(node_run, turn, right))
        return BrokenLink(words, turn.begin, goal.name)
    return None


def flag_differences(node_run: NodeRun, turn: Turn, right: Turn) -> str:
    """Words on what was True or False at this letter, and otherwise at the right one."""
    texts = [(name, series.text_at(turn.begin), series.text_at(right.begin))
             for name, series in node_run.variables.items()
             if set(series.text) == {'True', 'False'}]
    return ''.join('; {} was {} now, and {} then'.format(*each) for each in texts
                   if each[1] != each[2])


def not_turning(node_run: NodeRun) -> Optional[BrokenLink]:
    """Does `turning` become True by a letter?"""
    turning = node_run.flag('turning')
    if turning is None:
        return None
    for turn in node_run.cached(turns):
        part = turning.between(turn.begin + READ / 2.0, min(turn.end, turn.begin + 1.0))
        if len(part.value) > 4 and not (part.value == 1.0).any():
            error = f', at an error of {turn.error[0]:+.0f} degrees' if np.isfinite(
                turn.error[:1]).any() else ''
            return BrokenLink('after {}{}, {} stayed {}, or was {} again at once'.format(
                turn.letter, error, turning.name, part.text[-1], part.text[-1]), turn.begin,
                    turning.name)
    return None


def too_seldom(node_run: NodeRun) -> Optional[BrokenLink]:
    """Do commands come ten times a second, none of them from elsewhere?"""
    turning = node_run.flag('turning')
    for turn in node_run.cached(turns):
        if not len(turn.time) and turning is not None and (turning.between(
                turn.begin, min(turn.end, turn.begin + 1.0)).value == 1.0).sum() > 10:
            return BrokenLink('after {} {} was True, and no command came'.format(
                turn.letter, turning.name), turn.begin)
        if len(turn.moving) in (1, 2) and turn.moving[-1] == len(turn.time) - 1 and (
                turn.end - turn.time[-1] > LONGEST_COMMAND_GAP):
            return BrokenLink('after {} the command {:+.2f} rad/s came {}, and then none'.format(
                turn.letter, turn.command[-1], ('once', 'twice')[len(turn.moving) - 1]), turn.begin)
        if len(turn.moving) < 3:
            continue
        span = slice(turn.moving[0], turn.moving[-1] + 1)
        is_zero = turn.command[span] == 0.0
        slow_rate = slow_rate_text(turn.time[span])
        if slow_rate:
            return BrokenLink(slow_rate, turn.begin)
        if (np.diff(is_zero.astype(int)) > 0).sum() >= 3:
            return BrokenLink('{} of {} commands in the turn after {} were zero: another callback '
                              'publishes, too'.format(is_zero.sum(), len(is_zero), turn.letter),
                              turn.begin)
    return None


#: Kinds of commands: words, and whether the command k of a turn is one.
KINDS = (('differences up to 180', lambda turn, k: abs(turn.difference[k]) <= 180.0),
         ('errors to the left', lambda turn, k: turn.error[k] > 0.0),
         ('errors to the right', lambda turn, k: turn.error[k] < 0.0))


def wrong_command(node_run: NodeRun) -> Optional[BrokenLink]:
    """Has each command the side of the error, and a speed within the limits?"""
    found, sent = node_run.cached(turns), node_run.commands
    for turn in found:
        if len(turn.time) > 5 and not len(turn.moving) and abs(turn.error[-1]) > CLEAR:
            return BrokenLink(
                'after {}, for an error of {:.0f} degrees, angular.z stayed 0{}'.format(
                    turn.letter, turn.error[-1], other_field_text(node_run)),
                turn.begin, 'angular.z')
    wrong: List[Tuple[Turn, int]] = []
    right: List[Tuple[Turn, int]] = []
    for turn in found:
        clear = (np.abs(turn.error) > CLEAR) & (np.abs(turn.error) < 180.0 - CLEAR)
        for k in np.flatnonzero(clear & (np.abs(turn.command) > 0.02)):
            (wrong if turn.command[k] * turn.error[k] < 0.0 else right).append((turn, int(k)))
    if len(wrong) > 1:
        turn, k = wrong[0]
        if len(set(turn.command[turn.moving])) == 1 and len(turn.moving) > 5 and (
                abs(turn.difference[k]) <= 180.0):
            return BrokenLink(
                'in the turn after {} the command stayed {:+.2f} rad/s, while the error went from '
                '{:+.0f} to {:+.0f} degrees'.format(
                    turn.letter, turn.command[k], turn.error[turn.moving[0]], turn.error[k]),
                float(turn.time[k]), 'angular.z')
        return BrokenLink(turn.moment_text(k) + (steering_source_text(node_run, found) or next(
            (f'; for {words} it was right' for words, is_so in KINDS
             if any(is_so(*each) for each in right) and not any(is_so(*each) for each in wrong)),
            '')), float(turn.time[k]), 'angular.z')
    for turn in found:
        if len(turn.moving) and np.abs(turn.command).max() > MAX_ANG_Z + 0.01:
            k = int(np.argmax(np.abs(turn.command)))
            return BrokenLink('{}, at most {:g} are asked for{}'.format(
                turn.moment_text(k), MAX_ANG_Z, node_run.constant('MAX_ANG_Z', MAX_ANG_Z)),
                    float(turn.time[k]), 'angular.z')
        ahead = sent.linear[np.isin(sent.arrival, turn.time[turn.moving])]
        if (np.abs(ahead) > 0.01).sum() > 2:
            return BrokenLink('in the turn after {} linear.x was {:.2g}'.format(
                turn.letter, ahead[1]), turn.begin, 'linear.x')
    return None


def steering_source_text(node_run: NodeRun, found: Sequence[Turn]) -> str:
    """Words on another variable from which the commands turn to goal_yaw; '' if there is none."""
    _, quantity, _ = node_run.cached(heading)
    unit = quantity.per_degree if quantity is not None else 1.0
    for series in node_run.variables.values():
        if not np.isfinite(series.value).all() or np.ptp(series.value) < CLEAR * unit:
            continue
        sides = []
        for turn in found:
            read = np.array([series.at(at) for at in turn.time[turn.moving]])
            error = (turn.goal[turn.moving] - read) / unit
            error -= 360.0 * np.round(error / 360.0)
            clear = (np.abs(error) > CLEAR) & (np.abs(error) < 150.0)
            sides += list((error * turn.command[turn.moving])[clear] > 0.0)
        if len(sides) > 10 and np.mean(sides) > 0.95:
            return f'; it turns from {series.name} to goal_yaw'
    return ''


def wrong_stop(node_run: NodeRun) -> Optional[BrokenLink]:
    """Does a turn end within the tolerance, by a zero?"""
    turning, tolerance = node_run.flag('turning'), node_run.constant('HDG_TOL', HDG_TOL)
    for turn in node_run.cached(turns):
        if not len(turn.moving):
            if ended_at_once(turn, turning):
                return BrokenLink(
                    'the turn after {} was ended at once, at an error of {:+.0f} degrees; {:g} are '
                    'the tolerance{}'.format(turn.letter, turn.error[0], HDG_TOL, tolerance),
                    float(turn.time[0]), 'turning')
            continue
        last = int(turn.moving[-1])
        if last + 1 < len(turn.time) and abs(turn.error[last + 1]) > HDG_TOL + 4.0:
            return BrokenLink(
                'the turn after {} was ended at an error of {:+.0f} degrees; {:g} are the '
                'tolerance{}'.format(turn.letter, turn.error[last + 1], HDG_TOL,
                                     tolerance or same_time(node_run)),
                float(turn.time[last + 1]), 'turning')
        if last + 1 == len(turn.time) and turn.end - turn.time[last] > LONGEST_COMMAND_GAP:
            return BrokenLink('no zero followed the last command of the turn after {}: {}'.format(
                turn.letter, turn.moment_text(last)), float(turn.time[last]), 'angular.z')
        inner = np.flatnonzero(np.abs(turn.error[:last + 1]) < HDG_TOL / 2.0)
        # a node with a finer tolerance comes nearer, and ends by itself
        is_finer = len(inner) > 0 and turn.time[last] - turn.time[inner[0]] < FINER and (
            last + 1 < len(turn.time) or turn.is_cut) and (
            np.abs(turn.error[inner[0]:last + 1]).max() < HDG_TOL)
        if len(inner) and turn.time[last] - turn.time[inner[0]] > 0.5 and not is_finer:
            is_on = turning is not None and turning.at(turn.time[inner[0]] + 0.3) == 1.0
            return BrokenLink('{}, and the turn after {} went on{}{}'.format(
                turn.moment_text(inner[0]), turn.letter,
                ', with turning still True' if is_on else '',
                tolerance), float(turn.time[inner[0]]), 'turning')
    return None


def ended_at_once(turn: Turn, turning: Optional[Series]) -> bool:
    """Was `turning` True, and False by the first command, far from the goal?"""
    if turning is None or not len(turn.time) or turn.is_cut or not (
            abs(turn.error[0]) > HDG_TOL + 4.0):
        return False
    over = turn.time[0] + 2.0 * READ
    before, later = turning.between(turn.begin, over).value, turning.between(over, turn.end).value
    return bool(before.any() and len(later) > 4 and not later.any())


def same_time(node_run: NodeRun) -> str:
    """Words on turns that all took the same time, wherever they ended; else ''."""
    took = [np.ptp(turn.time[turn.moving]) for turn in node_run.cached(turns) if len(turn.moving)]
    return '; each turn took {:.1f} s, at whatever error it ended'.format(
        np.mean(took)) if len(took) > 2 and np.ptp(took) < 0.15 else ''


def not_over(node_run: NodeRun) -> Optional[BrokenLink]:
    """Does `turning` become False at the goal? Without typed letters it begins each turn."""
    turning, found = node_run.flag('turning'), node_run.cached(turns)
    if turning is None or not len(node_run.run.letters):
        return None
    for before, turn in zip(found[:1] + found, found):
        if turning.at(turn.begin - READ) == 1.0 and (before is turn or not before.is_cut):
            return BrokenLink('{} was still True when {} was typed: it did not become False at the '
                              'goal before'.format(turning.name, turn.letter), turn.begin,
                              turning.name)
    return None


def slow_law(node_run: NodeRun) -> Optional[BrokenLink]:
    """Is the command the gain times the error, within the limits?"""
    for turn in node_run.cached(turns):
        clear = np.flatnonzero((np.abs(turn.error) > 2.0 * MAX_ANG_Z / K_HDG) & (
            turn.command * turn.error > 0.0))
        if len(clear) and np.median(np.abs(turn.command[clear])) < 0.9 * MAX_ANG_Z:
            return BrokenLink('{}, by the handout it is {:+.2f}{}{}'.format(
                turn.moment_text(clear[0]), np.copysign(MAX_ANG_Z, turn.error[clear[0]]),
                node_run.constant('K_HDG', K_HDG), node_run.constant('MAX_ANG_Z', MAX_ANG_Z)),
                    float(turn.time[clear[0]]), 'angular.z', is_weak=True)
    return None
