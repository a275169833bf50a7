"""The known mistake that fits a recorded run of a student's node.

Each turn and each drive is compared with what a robot would have done there whose node makes the
mistake. A mistake fits if all movements are as it says; a run is right if all are as the handouts
say. Mistakes that do not show in the way that a robot takes are found by the commands. Nothing is
known of the node's text, of its start and its end, of the numbers of a pad's buttons, and of
persons who drive: a mistake needs evidence that no right node gives, whatever they do. The marking
makes such a run of what it saw (see :mod:`tb3_labs.marking.trial.observation`), so that a mark, a
check and a report say the same.

Units: metres, radians, seconds since the recording's start.
"""
import math
import re
from dataclasses import dataclass, replace
from itertools import islice
from typing import Dict, Iterable, Optional, Sequence, Tuple

import numpy as np

from tb3_labs.geometry.angles import wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.report.cause import diagnosed_drives, diagnosed_turns
from tb3_labs.report.cause.diagnosed_drives import (
    Fit, Fresh, fresh_drives, ghost, said_reached, was_lost)
from tb3_labs.report.cause.diagnosed_turns import LAWS, TOO_FAST, Turn, turns_of
from tb3_labs.report.cause.mistakes import WAYS, Way, lost
from tb3_labs.report.motion.movements import (
    LAB_GOAL, TERMINAL, cuts, has_control, movements, moving, programs)
from tb3_labs.report.run_data import Poses, RunData
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT

#: The labs whose nodes are diagnosed.
TURN, DRIVE, PAD = 'turn', 'drive', 'pad'
#: Programs by which a person drives.
BY_HAND = re.compile(r'/(\w+/)*(rostopic_|rqt_|\w*teleop)\w*')
#: A mistake fits if the run is nearer to it than this [m], [rad]. Others that are farther from the
#: run by less than ALIKE are told as well.
FITS, ALIKE = 0.12, 0.03
#: Later turns and drives of a run are not compared.
MOST_COMPARED = 100
#: Two senders: this many changes between zero and a movement, each within QUICK [s].
JUMPS, QUICK = 10, 0.25
#: They begin this soon after a button gave control, before a gamepad could be started anew [s].
SOON = 1.0
#: A run that ends within this time after a command may have ended by Ctrl+C [s].
SECOND_AFTER = 1.0
#: The last command before a node says that it reached its goal is not older than this [s].
BEFORE = 0.3
#: The handouts' nodes send ten commands a second. A node sleeps if after each command that moves
#: the robot, at least SLOW_STEPS of them, more than SLOWEST [s] pass, and less than
#: QUICKEST_PERSON, all within the factor EVEN.
SLOW_STEPS, SLOWEST, QUICKEST_PERSON, EVEN = 4, 0.45, 6.0, 1.15
#: A letter is answered by a turn within this time [s].
ANSWERED_BY = 1.2
#: A node must drive to a goal that is farther than this [m].
LEAST_WAY = 0.3
#: A robot whose node always turns to 0 rests this near to it [rad].
NEAR_ZERO = math.radians(20.0)
#: A button answers within this time [s].
ANSWERED = 0.6


@dataclass(frozen=True)
class Diagnosis:
    """The known mistake that fits a run.

    `apart`: how far the run is from this mistake, from a right node, and from `other` [m], in the
    IMU lab [rad]; NaN: unknown. Poses are in ``odom``.
    """

    mistake: Optional[str]              # '' if the run is right, None if no known mistake fits
    lab: str = DRIVE
    also: Tuple[str, ...] = ()          # others that fit as well, its equals
    besides: str = ''                   # a second mistake in the same run
    apart: Tuple[float, float, float] = (math.nan, math.nan, math.nan)
    other: str = ''                     # the next likely mistake
    moment: float = 0.0                 # start of the movement farthest from a right one [s]
    ghost: Poses = Poses.none()         # of a robot with this mistake
    asked: Poses = Poses.none()         # of a right robot

    @property
    def causes(self) -> Tuple[str, ...]:
        """All mistakes that explain the run equally well."""
        return (self.mistake, *self.also) if self.mistake else ()


def diagnose(run: RunData) -> Diagnosis:
    """Returns the Diagnosis of a run. A run in which nothing can be judged, or which is not that of
    a student's node, is right. The goal is the first of the run, else the lab's."""
    if not is_students(run):
        return Diagnosis('')
    goal = run.goals.pose(0) if len(run.goals) else LAB_GOAL
    two, slow = _two_senders(run), _slow_commands(run)
    if two is not None:
        return Diagnosis('two_senders', PAD, moment=two)
    if slow is not None:
        return Diagnosis('sleeps', DRIVE if len(run.control) else TURN, moment=slow)
    if len(_steps(run)) and np.median(_steps(run)) > SLOWEST:
        return Diagnosis('')        # whatever its law is, movements end by chance, or after a time
    if len(run.control):
        drives = list(islice(fresh_drives(run, movements(run)), MOST_COMPARED))
        by_way, unstopped = _by_drives(drives, goal), [
            time for time in said_reached(run) if _drives_on(run, time)]
    else:
        turns = [turn for turn in turns_of(run)
                 if not (turn.is_persons or 'joy' in run.devices)][:MOST_COMPARED]
        whole = [turn for turn in turns if not turn.may_be_cut]
        by_way, unstopped = _by_turns(run, turns), [
            turn.begin for turn in whole if not any(each.is_stopped for each in whole)]
    if by_way.mistake == '' and unstopped:
        return Diagnosis('no_stop', DRIVE if len(run.control) else TURN, moment=unstopped[0])
    return _unanswered(run) or _state_kept(run, by_way, goal) or by_way


def is_students(run: RunData) -> bool:
    """Did a student's node drive? The finished nodes publish their states and turns; a person
    drives by other programs."""
    is_finished = len(run.asked) or len(run.states) and 'states' not in run.derived
    return not is_finished and not (run.senders and all(map(BY_HAND.match, run.senders)))


def _by_drives(fresh: Sequence[Fresh], goal: Pose2) -> Diagnosis:
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


def _by_turns(run: RunData, seen: Sequence[Turn]) -> Diagnosis:
    """Returns the Diagnosis of these turns of a run, without mistakes that the commands show."""
    if not seen:
        return Diagnosis('', TURN)
    fastest = max(seen, key=lambda turn: abs(turn.peak))
    if abs(fastest.peak) > TOO_FAST:
        is_left = any(turn.peak > TOO_FAST for turn in seen)
        return Diagnosis('no_clamp' if is_left else 'no_negative_clamp', TURN,
                         moment=fastest.begin)
    fits = _best(Fit(law.mistake, [diagnosed_turns.apart(law, turn) for turn in seen])
                 for law in LAWS)
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


# Commands ---------------------------------------------------------------------------------------

def _two_senders(run: RunData) -> Optional[float]:
    """Returns the time from which on zeros come between the commands of a moving robot, again and
    again, although a button of the pad has just given control to a node."""
    if 'mouse_info' in run.devices:
        return None    # a controller beside it answers each message of its mouse
    given = np.flatnonzero(np.diff(run.control.value, prepend=0.0) > 0.0)
    for grant in given:
        begin = float(run.control.time[grant])
        taken = run.control.time[grant:][run.control.value[grant:] == 0.0]
        commands = run.commands.between(begin, min([*taken[:1], math.inf]))
        edges = commands.time[1:][np.diff(moving(commands).astype(int)) != 0]
        if len(run.presses.between(begin - ANSWERED, begin + 0.05)) and any(
                last - first < JUMPS * QUICK and first < begin + SOON
                for first, last in zip(edges, edges[JUMPS:])):
            return begin
    return None


def _slow_commands(run: RunData) -> Optional[float]:
    """Returns the time of the first command if all of a node's commands to a moving robot were
    followed too late by the next, else None. A person who sends single commands is not so even.
    The last command of a run may come at Ctrl+C."""
    if programs(run, 0.0, run.duration) == [TERMINAL]:
        return None
    steps = _steps(run)
    is_even = len(steps) >= SLOW_STEPS and SLOWEST < steps.min() and steps.max() < min(
        EVEN * steps.min(), QUICKEST_PERSON)
    return float(run.commands.time[moving(run.commands)][0]) if is_even else None


def _steps(run: RunData) -> np.ndarray:
    """The times from each command that moves the robot, but for the last one, to the next [s]."""
    return np.diff(run.commands.time[:-1])[moving(run.commands)[:-2]]


def _unanswered(run: RunData) -> Optional[Diagnosis]:
    """Returns the Diagnosis if no turn followed some of the letters that were typed."""
    if not len(run.letters) or len(run.control):
        return None
    ends = np.append(run.letters.time[1:], run.duration)
    asked = [(side, run.commands.between(begin, end), begin) for begin, end, side in zip(
        run.letters.time, ends, run.letters.value) if side and end - begin > ANSWERED_BY]
    is_answered = [bool(moving(sent).any()) for _, sent, _ in asked]
    if all(is_answered) or not any(is_answered):
        return None
    _, _, moment = asked[is_answered.index(False)]
    if all(answered == (side > 0.0) for answered, (side, _, _) in zip(is_answered, asked)):
        return Diagnosis('no_abs', TURN, moment=float(moment))
    if is_answered[0] and not any(is_answered[1:]):
        at_zero = abs(wrap(float(run.imu.yaw_at(moment)))) < NEAR_ZERO
        return Diagnosis('goal_kept' if at_zero else 'never_over', TURN, moment=float(moment))
    return None


def _state_kept(run: RunData, by_way: Diagnosis, goal: Pose2) -> Optional[Diagnosis]:
    """Returns the Diagnosis if the node told of a reset after it had reached its goal, and then did
    not move although control was given anew."""
    if by_way.mistake != '' or not len(run.control):
        return None
    reached, moves = said_reached(run), run.commands.time[moving(run.commands)]
    given = run.control.time[np.diff(run.control.value, prepend=0.0) > 0.0]
    for k, reset in enumerate(run.resets.time):
        far = run.resets.pose(k).distance_to(goal) > LEAST_WAY
        for grant in given[given >= reset][:1] if far and (reached < reset).any() else ():
            ends = np.concatenate([run.resets.time, run.control.time, [run.duration]])
            end = ends[ends > grant].min()
            if end - grant > ANSWERED_BY and not ((moves > grant) & (moves < end)).any() and not (
                    was_lost(run.imu, reset, end) or was_lost(run.odometry, reset, end)):
                return Diagnosis('state_kept', moment=float(grant))
    return None


def _drives_on(run: RunData, reached: float) -> bool:
    """Did the node that said at this time [s] that it reached its goal send no zero?"""
    commands = run.commands.between(reached - BEFORE, reached + COMMAND_TIMEOUT)
    ends = np.append(cuts(run), run.duration)
    return bool(has_control(run, reached) and len(commands) and moving(commands).all()
                and len(set(commands.between(reached, math.inf).angular)) <= 1
                and (np.abs(ends - reached) > SECOND_AFTER).all())
