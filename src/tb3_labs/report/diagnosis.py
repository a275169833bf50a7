"""The known mistake that fits a recorded run of a student's node.

Each turn and each drive is compared with what a robot would have done there whose node makes the
mistake. A mistake fits if all movements are as it says; a run is right if all are as the handouts
say. Mistakes that do not show in the way that a robot takes are found by the commands and the
buttons. Nothing is known of the node's text.

Units: metres, radians, seconds since the recording's start.
"""
import math
from dataclasses import dataclass, replace
from typing import Dict, Iterable, Optional, Sequence, Tuple

import numpy as np

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.report import diagnosed_drives, diagnosed_turns
from tb3_labs.report.diagnosed_drives import Fit, Fresh, fresh_drives, ghost
from tb3_labs.report.diagnosed_turns import TOO_FAST, Turn, stretches, turns_of
from tb3_labs.report.mistakes import LAWS, WAYS, Way, lost
from tb3_labs.report.movements import (
    FASTEST_BY_MOUSE, LAB_GOAL, NO_SPEED, cuts, has_control, movements, moving)
from tb3_labs.report.run_data import Commands, Poses, RunData
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT

#: The labs whose nodes are diagnosed.
TURN, DRIVE, PAD = 'turn', 'drive', 'pad'
#: A mistake fits if the run is nearer to it than this [m], [rad]. Others that are farther from the
#: run by less than ALIKE are told as well.
FITS, ALIKE = 0.12, 0.03
#: Two senders: this many changes between zero and a movement, each within QUICK [s].
JUMPS, QUICK = 10, 0.25
#: A run that ends within this time after a command may have ended by Ctrl+C [s].
AFTERWARDS = 1.0
#: A node that has forgotten its stop sends one speed for longer than this [s].
TAIL = 15.0
#: A button answers within ANSWERED [s]. RESETS: the button that resets the frame in the handout.
ANSWERED, RESETS = 0.6, 2


@dataclass(frozen=True)
class Diagnosis:
    """The known mistake that fits a run.

    `apart`: how far the run is from this mistake, from a right node, and from `other` [m], in the
    IMU lab [rad]; NaN: unknown. Poses are in ``odom``.
    """

    mistake: Optional[str]              # '' if the run is right, None if no known mistake fits
    lab: str = DRIVE
    also: Tuple[str, ...] = ()          # other mistakes that fit as well
    besides: str = ''                   # a second mistake in the same run
    apart: Tuple[float, float, float] = (math.nan, math.nan, math.nan)
    other: str = ''                     # the next likely mistake
    moment: float = 0.0                 # start of the movement farthest from a right one [s]
    ghost: Poses = Poses.none()         # of a robot with this mistake
    asked: Poses = Poses.none()         # of a right robot


def diagnose(run: RunData) -> Diagnosis:
    """Returns the Diagnosis of a run. A run in which nothing can be judged is right. The goal is
    the first of the run, else the lab's."""
    goal = run.goals.pose(0) if len(run.goals) else LAB_GOAL
    by_pad = _of_pad(run)
    if by_pad is not None:
        return by_pad
    lab = DRIVE if len(run.control) else TURN
    if lab == DRIVE:
        by_way = of_drives(list(fresh_drives(run, movements(run))), goal)
    else:
        by_way = of_turns(run, turns_of(run))
    unstopped = _no_stop(run)
    if unstopped is None:
        return by_way
    if by_way.mistake:
        return replace(by_way, besides=by_way.besides or 'no_stop')
    return Diagnosis('no_stop', lab, moment=unstopped)


def of_drives(fresh: Sequence[Fresh], goal: Pose2) -> Diagnosis:
    """Returns the Diagnosis of these drives, without mistakes that the commands show."""
    if not fresh:
        return Diagnosis('')
    result = _of_drives(fresh, goal, WAYS)
    if result.mistake is None and any(last.pose != Pose2() for _, last, _ in fresh):
        # the code that students are given loses the declared pose, beside their own mistakes
        other = _of_drives(fresh, goal, [replace(way, declared=lost) for way in WAYS])
        if other.mistake:
            return replace(other, besides='declared_lost')
    return result


def _of_drives(fresh: Sequence[Fresh], goal: Pose2, ways: Sequence[Way]) -> Diagnosis:
    seen = [drive for drive, _, _ in fresh]
    fits = _best(diagnosed_drives.compared(fresh, goal, way) for way in ways)
    result = _decided(DRIVE, fits, [drive.times[0] for drive in seen])
    if result.mistake == '':
        return result
    return replace(result, asked=ghost(seen, fits[''].ideals), ghost=(
        ghost(seen, fits[result.mistake].ideals) if result.mistake else Poses.none()))


def of_turns(run: RunData, seen: Sequence[Turn]) -> Diagnosis:
    """Returns the Diagnosis of these turns of a run, without mistakes that the commands show."""
    if not seen:
        turns = np.abs(run.commands.angular) > FASTEST_BY_MOUSE + NO_SPEED
        return Diagnosis(None if turns.any() and 'joy' not in run.devices else '', TURN)
    fastest = max(seen, key=lambda turn: abs(turn.peak))
    if abs(fastest.peak) > TOO_FAST:
        is_left = any(turn.peak > TOO_FAST for turn in seen)
        return Diagnosis(None if is_left else 'no_negative_clamp', TURN, moment=fastest.begin)
    fits = _best(diagnosed_turns.compared(seen, law) for law in LAWS)
    result = _decided(TURN, fits, [turn.begin for turn in seen])
    if result.mistake == 'no_negative_clamp' and not diagnosed_turns.begin_slowly(run, seen):
        return replace(result, mistake=None)
    return result


def _best(fits: Iterable[Fit]) -> Dict[str, Fit]:
    """Returns the best Fit of each mistake, since it can be made in several ways."""
    best: Dict[str, Fit] = {}
    for fit in fits:
        if fit.mistake not in best or max(fit.apart) < max(best[fit.mistake].apart):
            best[fit.mistake] = fit
    return best


def _decided(lab: str, fits: Dict[str, Fit], begins: Sequence[float]) -> Diagnosis:
    """Returns the Diagnosis by the best Fit of each mistake."""
    worst = {mistake: max(fit.apart) for mistake, fit in fits.items()}
    right, moment = worst.pop(''), begins[int(np.argmax(fits[''].apart))]
    order = sorted(worst, key=lambda mistake: worst[mistake])
    best = order[0]
    if right <= FITS:
        return Diagnosis('', lab, apart=(right, right, worst[best]), moment=moment)
    if worst[best] > FITS:
        return Diagnosis(None, lab, apart=(worst[best], right, math.nan), other=best, moment=moment)
    alike = min(FITS, max(FITS / 2.0, worst[best] + ALIKE))
    also = tuple(mistake for mistake in order[1:] if worst[mistake] <= alike)
    rest = order[1 + len(also):]
    other = rest[0] if rest else ''
    return Diagnosis(best, lab, also, apart=(worst[best], right, worst.get(other, math.nan)),
                     other=other, moment=moment)


# Commands and buttons -------------------------------------------------------------------------

def _of_pad(run: RunData) -> Optional[Diagnosis]:
    """The mistakes of a gamepad's node."""
    two = _two_senders(run)
    if two is not None:
        return Diagnosis('two_senders', PAD, moment=two)
    other = _wrong_button(run)
    return None if other is None else Diagnosis('wrong_button', PAD, moment=other)


def _two_senders(run: RunData) -> Optional[float]:
    """Returns the time from which on zeros come between the commands of a moving robot, again and
    again."""
    moves, time = moving(run.commands), run.commands.time
    edges = np.flatnonzero(np.diff(moves.astype(int)))
    for first, last in zip(edges, edges[JUMPS:]):
        if time[last] - time[first] < JUMPS * QUICK:
            return float(time[first])
    return None


def _wrong_button(run: RunData) -> Optional[float]:
    """Returns the time of a press of the right button that did not reset the frame, or of a wrong
    one that did. Without any reset there may be no node that has the frame."""
    if not len(run.resets):
        return None
    for time, button in zip(run.presses.time, run.presses.value):
        was_reset = ((run.resets.time >= time - 0.1) & (run.resets.time < time + ANSWERED)).any()
        if was_reset != (int(button) == RESETS):
            return float(time)
    return None


def _no_stop(run: RunData) -> Optional[float]:
    """Returns the end of a node's movement that nobody cut off, after which no command stopped the
    robot. In the IMU lab a node does not drive forward."""
    time, moves = run.commands.time, moving(run.commands)
    ends = np.append(cuts(run), run.duration)
    for first, after in stretches(moves, time):
        last = float(time[after - 1])
        is_node = has_control(run, (float(time[first]) + last) / 2.0) if len(run.control) else not (
            run.commands.linear[first:after] > NO_SPEED).any()
        if not is_node:
            continue
        following = float(time[after]) if after < len(time) else math.inf
        if following - last > COMMAND_TIMEOUT and (np.abs(ends - last) > AFTERWARDS).all():
            return last
        if _goes_on(run.commands.between(time[first], last)):
            return last
    return None


def _goes_on(commands: Commands) -> bool:
    """Do these commands end by turning at one speed for long?"""
    if not len(commands) or commands.time[-1] - commands.time[0] < TAIL:
        return False
    tail = commands.between(commands.time[-1] - TAIL, math.inf)
    return bool(np.ptp(tail.angular) == 0.0 and (np.abs(tail.linear) <= NO_SPEED).all())
