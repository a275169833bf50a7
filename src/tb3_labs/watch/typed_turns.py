"""The turns of a run as its node had them: the letter, the goal, each command with its error."""
from dataclasses import dataclass
from typing import Any, List, NamedTuple, Optional, Tuple

import numpy as np

from tb3_labs.handout import HDG_TOL, MOUSE_DEAD_ZONE, TURN_DEG
from tb3_labs.watch.broken_link import (
    BrokenLink, NodeRun, followed_heading, is_usable_heading)
from tb3_labs.watch.quantities import Quantity, heading_from_another_zero, matching_quantities
from tb3_labs.watch.variables import Series

#: A node reads a letter within LETTER_DELAY [s]. Variables are read every READING_PERIOD [s].
LETTER_DELAY, READING_PERIOD = 3.0, 0.06
#: The side of an error is clear if the error is between CLEAR and 180 - CLEAR [deg].
CLEAR = 20.0
#: A turn ends by at most this over the tolerance [deg].
OVER_TOLERANCE = 4.0
#: A variable with another name is the heading only if its range is larger.
LEAST_RANGE = 0.5


def by_the_short_way(degrees: Any) -> Any:
    """Returns angles wrapped to -180 to 180."""
    return degrees - 360.0 * np.round(degrees / 360.0)


@dataclass(frozen=True)
class Turn:
    """A letter that was typed, and the turn after it, until the next letter. The turn `is_cut` if
    the mouse is moved before the next letter, or the node ends. `side`: 1 for l, -1 for r, 0 if it
    is unknown.

    Angles in the node's own unit: `own`, curr_yaw at the letter; `before` and `after`, goal_yaw as
    a text, '' if there is none. Arrays with a value for each command: the time, angular.z, goal_yaw
    and curr_yaw at this time, and their difference [deg], NaN if the goal is not known.
    """

    begin: float
    end: float
    is_cut: bool
    side: int
    own: float
    before: str
    after: str
    time: np.ndarray
    command: np.ndarray
    goal: np.ndarray
    heading: np.ndarray
    difference: np.ndarray

    @property
    def letter(self) -> str:
        return {1: 'l', -1: 'r'}.get(self.side, 'a letter')

    @property
    def error(self) -> np.ndarray:
        """The error of each command by the short way [deg]."""
        return by_the_short_way(self.difference)

    @property
    def moving(self) -> np.ndarray:
        """The indices of the commands that turn."""
        return np.flatnonzero(self.command)

    @property
    def clear(self) -> np.ndarray:
        """The indices of the commands that turn while the side of the error is clear."""
        is_clear = (np.abs(self.error) > CLEAR) & (np.abs(self.error) < 180.0 - CLEAR)
        return np.flatnonzero(is_clear & (np.abs(self.command) > 0.02))

    def ends_at_once(self, turning: Series) -> bool:
        """Was `turning` True, and False by the first command, far from the goal?"""
        if self.is_cut or not (np.abs(self.error[:1]) > HDG_TOL + OVER_TOLERANCE).any():
            return False
        over = self.time[0] + 2.0 * READING_PERIOD
        later = turning.between(over, self.end).value
        return bool(turning.between(self.begin, over).value.any()
                    and len(later) > 4 and not later.any())

    def command_text(self, k: int) -> str:
        """Returns a clause on a command and its error, and on how the error is wrapped."""
        words = f'for an error of {self.error[k]:+.0f} degrees'
        if abs(self.difference[k]) > 180.0:
            words = 'goal_yaw {:.4g} minus curr_yaw {:.4g} is {:+.0f}, by the short way {:+.0f} ' \
                'degrees:'.format(self.goal[k], self.heading[k], self.difference[k], self.error[k])
        return f'{words} the command was {self.command[k]:+.2f} rad/s'


class OwnHeading(NamedTuple):
    """The node's variable for the heading, the quantity that it follows, or the BrokenLink if it is
    not a usable heading; None if there is none."""

    series: Optional[Series] = None
    quantity: Optional[Quantity] = None
    broken: Optional[BrokenLink] = None


def own_heading(node_run: NodeRun) -> OwnHeading:
    """Returns the OwnHeading of a node."""
    series = node_run.find('curr_yaw')
    if series is None:
        series = renamed_heading(node_run)
    elif matching_quantities(series, [node_run.heading]):
        return OwnHeading(series, node_run.heading)
    if series is None:
        return OwnHeading()
    quantity, broken = followed_heading(series, node_run.imu_quantities)
    if broken is not None and 'does not follow' in broken.words:
        for unit in (1.0, np.pi / 180.0):       # a turn needs no certain zero
            another = heading_from_another_zero(series, node_run.heading, unit)
            if another is not None:
                return OwnHeading(series, another)
    return OwnHeading(series, quantity, broken)


def renamed_heading(node_run: NodeRun) -> Optional[Series]:
    """Returns the first variable that follows a usable heading, else the first that follows another
    quantity of the IMU."""
    others = []
    for series in node_run.variables.values():
        if 'goal' in series.name or not np.isfinite(series.value).any() or (
                np.nanmax(series.value) - np.nanmin(series.value) <= LEAST_RANGE):
            continue
        found = matching_quantities(series, node_run.imu_quantities)
        if found and is_usable_heading(found[0], node_run.heading):
            return series
        others += [series] if found else []
    return others[0] if others else None


def goal_changes(node_run: NodeRun) -> Tuple[List[float], List[float]]:
    """Returns the times at which a letter had changed goal_yaw while `turning` stayed True (it was
    the next letter of a queue, or was typed in a turn), and while `turning` stayed False."""
    series, quantity, _ = node_run.cached(own_heading)
    turning, goal = node_run.flag('turning'), node_run.find('goal_yaw')
    in_turns: List[float] = []
    without_turns: List[float] = []
    if turning is None or goal is None:
        return in_turns, without_turns
    is_new = np.hstack([False, goal.text[1:] != goal.text[:-1], False])
    # a goal that goes on and on is a mistake
    alone = goal.time[1:][is_new[1:-1] & ~is_new[:-2] & ~is_new[2:]]
    for time in goal.changes:
        near = turning.between(time - 2.0 * READING_PERIOD, time + 8.0 * READING_PERIOD).value
        if turning.at(time - 2.0 * READING_PERIOD) == turning.at(time) == 1.0:
            in_turns += [time] if time in alone else []
        elif series is not None and quantity is not None and len(near) > 5 and not near.any():
            off = abs((goal.at(time) - series.at(time)) / quantity.per_degree)
            if min(abs(off - TURN_DEG), abs(360.0 - off - TURN_DEG)) < 1.0:
                without_turns.append(time)
    return in_turns, without_turns


def letters(node_run: NodeRun) -> List[Tuple[float, float, bool, int]]:
    """Returns (begin, end, is_cut, side) of each typed letter. If letters were not recorded, they
    are found by `turning` and `goal_yaw`."""
    typed, turning, goal = node_run.run.letters, node_run.flag('turning'), node_run.find('goal_yaw')
    mouse, found = node_run.run.mouse, []
    times, sides = typed.arrival, typed.value
    if not len(typed):
        in_turns, without_turns = node_run.cached(goal_changes)
        changes = goal.changes if goal is not None else np.empty(0)
        if turning is not None:
            changes = np.append(turning.time[1:][np.diff(turning.value) > 0.0], without_turns)
        times = np.union1d(changes - 2.0 * READING_PERIOD, in_turns)
        sides = np.zeros(len(times))
    drives = (mouse.active > 0.0) & (np.maximum(abs(mouse.x), abs(mouse.y)) >= MOUSE_DEAD_ZONE)
    for begin, end, side in zip(times, np.append(times[1:], node_run.run.duration), sides):
        # the latest message of the mouse before the letter counts, too
        first, last = np.searchsorted(mouse.arrival, (begin, end))
        part = slice(max(first - 1, 0), last)
        cut = min(*mouse.arrival[part][drives[part]][:1], node_run.end_after(begin), end)
        # a letter other than l and r only ends a turn
        if cut > begin and (side or not len(typed)):
            found.append((float(begin), float(cut), bool(cut < end), int(side)))
    return found


def turns(node_run: NodeRun) -> List[Turn]:
    """Returns the turns of a run. Without goal_yaw their goals are those of the letters."""
    series, quantity, _ = node_run.cached(own_heading)
    used, goal, sent = quantity, node_run.find('goal_yaw'), node_run.commands
    if used is None:
        used, series, goal = node_run.heading, None, None
    if not len(node_run.run.letters) and goal is not None:
        for time in node_run.cached(goal_changes)[0]:
            # between two readings the goal is not known
            last = goal.time[np.searchsorted(goal.time, time) - 1]
            sent = sent.take((sent.arrival <= last) | (sent.arrival > time))
    found = []
    for begin, end, is_cut, side in letters(node_run):
        own = series.at(begin) if series is not None else float(used.at(np.array([begin]))[0])
        read, before, after = begin, '', ''
        if goal is not None:        # the letter is read when goal_yaw changes, if it does
            changes = goal.between(begin, min(end, begin + LETTER_DELAY)).changes
            read = float(changes[0]) if len(changes) else begin + READING_PERIOD
            before, after = goal.text_at(begin), goal.text_at(read + READING_PERIOD)
        commands = sent.take((sent.arrival > max(begin, read - 2.0 * READING_PERIOD)) & (
            sent.arrival < end))
        times, now = commands.arrival, used.at(commands.arrival)
        if goal is None:
            goals = np.full(len(times), own + side * TURN_DEG * used.per_degree)
        else:
            goals = np.array([goal.at(min(max(time, read) + READING_PERIOD, np.nextafter(end, 0.0)))
                              for time in times])
        unknown = 0.0 if side or goal is not None else np.nan
        found.append(Turn(
            begin, end, is_cut, side, own, before, after, times, commands.angular, goals, now,
            (goals - now) / used.per_degree + unknown))
    return found
