"""The turns of a node, from its own variables. A turn has a letter, a goal, commands and errors."""
from dataclasses import dataclass
from typing import Any, List, NamedTuple, Optional, Tuple

import numpy as np

from tb3_labs.geometry.arrays import last_before, wrap_all
from tb3_labs.handout import HDG_TOL, MOUSE_DEAD_ZONE, TURN_DEG
from tb3_labs.watch.broken_link import (
    BrokenLink, NodeRun, followed_heading, is_usable_heading)
from tb3_labs.watch.quantities import Quantity, heading_from_another_zero, matching_quantities
from tb3_labs.watch.variables import Series

#: A node reads a typed letter within this time [s].
LETTER_DELAY = 3.0
#: The probe reads the variables of a node about once in this time [s].
READING_PERIOD = 0.06
#: The side of an error is clear if the error is between CLEAR_ERROR and 180 - CLEAR_ERROR [deg].
CLEAR_ERROR = 20.0
#: The error at the end of a turn may exceed the handout's tolerance by this [deg].
OVER_TOLERANCE = 4.0
#: A variable that is not named curr_yaw is the heading only if its values differ by more than this.
MIN_RANGE = 0.5
#: (begin, end, is_cut, side): the first fields of a NodeTurn.
TypedLetter = Tuple[float, float, bool, int]


@dataclass(frozen=True)
class NodeTurn:
    """The turn after a typed letter, until the next letter. `side` is 1 for the letter l, -1 for r,
    and 0 for an unknown letter. A turn `is_cut` if the mouse was moved, or the node ended, before
    the next letter was typed.

    Angles have the node's own unit. `begin_yaw` is curr_yaw when the letter was typed.
    `goal_before` and `goal_after` are the texts of goal_yaw before and after the node read the
    letter; both are '' if the node has no goal_yaw. The arrays have a value for each command of
    the turn: `command` is angular.z, `goal` is goal_yaw, and `heading` is curr_yaw. `difference` is
    goal_yaw minus curr_yaw [deg], and NaN if the goal is not known.
    """

    begin: float
    end: float
    is_cut: bool
    side: int
    begin_yaw: float
    goal_before: str
    goal_after: str
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
        """goal_yaw minus curr_yaw at each command, wrapped to (-180, 180] [deg]."""
        return wrap_all(self.difference, 360.0)

    @property
    def moving(self) -> np.ndarray:
        """The indices of the commands that turn."""
        return np.flatnonzero(self.command)

    @property
    def clear(self) -> np.ndarray:
        """The indices of the commands that turn while the side of the error is clear."""
        is_clear = (np.abs(self.error) > CLEAR_ERROR) & (np.abs(self.error) < 180.0 - CLEAR_ERROR)
        return np.flatnonzero(is_clear & (np.abs(self.command) > 0.02))

    def ends_at_once(self, turning: Series) -> bool:
        """Did `turning` become False at the first command, while the goal was far?"""
        if self.is_cut or not (np.abs(self.error[:1]) > HDG_TOL + OVER_TOLERANCE).any():
            return False
        over = self.time[0] + 2.0 * READING_PERIOD
        later = turning.between(over, self.end).value
        return bool(turning.between(self.begin, over).value.any()
                    and len(later) > 4 and not later.any())

    def command_text(self, k: int) -> str:
        """Returns a clause on command `k` and its error. If the difference is more than half a
        turn, the clause has the difference and the wrapped error."""
        clause = f'for an error of {self.error[k]:+.0f} degrees'
        if abs(self.difference[k]) > 180.0:
            clause = 'goal_yaw {:.4g} minus curr_yaw {:.4g} is {:+.0f}, by the short way {:+.0f} ' \
                'degrees:'.format(self.goal[k], self.heading[k], self.difference[k], self.error[k])
        return f'{clause} the command was {self.command[k]:+.2f} rad/s'


class OwnHeading(NamedTuple):
    """`series` is the node's variable for the heading, or None. `quantity` is the usable heading
    that this variable follows. If it follows no usable heading, `broken` is the BrokenLink."""

    series: Optional[Series] = None
    quantity: Optional[Quantity] = None
    broken: Optional[BrokenLink] = None


def own_heading(node_run: NodeRun) -> OwnHeading:
    series = node_run.variable('curr_yaw')
    if series is None:
        series = renamed_heading(node_run)
    if series is None:
        return OwnHeading()
    quantity, broken = followed_heading(series, node_run.imu_quantities)
    if broken is not None and 'does not follow' in broken.message:
        # a node can turn correctly by a heading that is 0 in any direction
        for unit in (1.0, np.pi / 180.0):
            another = heading_from_another_zero(series, node_run.heading, unit)
            if another is not None:
                return OwnHeading(series, another)
    return OwnHeading(series, quantity, broken)


def renamed_heading(node_run: NodeRun) -> Optional[Series]:
    """Returns the first variable that follows a usable heading, for a node without curr_yaw. If
    there is none, returns the first variable that follows any quantity of the IMU, or None."""
    followers = []
    for series in node_run.variables.values():
        numbers = series.value[np.isfinite(series.value)]
        if 'goal' in series.name or not len(numbers) or np.ptp(numbers) <= MIN_RANGE:
            continue
        found = matching_quantities(series, node_run.imu_quantities)
        if found and is_usable_heading(found[0], node_run.heading):
            return series
        if found:
            followers.append(series)
    return followers[0] if followers else None


def typed_letters(node_run: NodeRun) -> List[TypedLetter]:
    """Returns the TypedLetters of a run. If the recording has no letters, `turning` shows when the
    letters were typed."""
    mouse = node_run.run.mouse
    is_recorded = len(node_run.run.letters) > 0
    if is_recorded:
        times, sides = node_run.run.letters.arrival, node_run.run.letters.value
    else:
        times = unrecorded_letters(node_run)
        sides = np.zeros(len(times))
    drives = (mouse.active > 0.0) & (np.maximum(abs(mouse.x), abs(mouse.y)) >= MOUSE_DEAD_ZONE)
    found = []
    for begin, end, side in zip(times, np.append(times[1:], node_run.run.duration), sides):
        if is_recorded and not side:
            continue        # a letter other than l and r starts no turn
        # when the letter is typed, the last message of the mouse is still in force
        first = max(last_before(mouse.arrival, begin), 0)
        during = slice(first, np.searchsorted(mouse.arrival, end))
        moved = mouse.arrival[during][drives[during]]
        cut = min(*moved[:1], node_run.end_after(begin), end)
        if cut > begin:
            found.append((float(begin), float(cut), bool(cut < end), int(side)))
    return found


def unrecorded_letters(node_run: NodeRun) -> np.ndarray:
    """Returns the times at which `turning` became True. Returns no time if goal_yaw changes in a
    turn: then the letters may wait in a queue, and it is not known which commands belong to which
    letter."""
    turning, goal = node_run.boolean_variable('turning'), node_run.variable('goal_yaw')
    if turning is None:
        return np.empty(0)
    goal_changes = np.empty(0) if goal is None else goal.changes
    for time in goal_changes:
        if turning.at(time - 2.0 * READING_PERIOD) == turning.at(time) == 1.0:
            return np.empty(0)
    becomes_true = turning.time[1:][np.diff(turning.value) > 0.0]
    # the node may have read the letter up to two periods of the probe earlier
    return becomes_true - 2.0 * READING_PERIOD


def letter_turns(node_run: NodeRun) -> List[NodeTurn]:
    """Returns the NodeTurn of each letter of a run."""
    series, quantity, _ = node_run.cached(own_heading)
    goal = node_run.variable('goal_yaw')
    if quantity is None:        # the turns are found by the correct heading
        quantity, series, goal = node_run.heading, None, None
    return [turn_of(letter, node_run.commands, quantity, series, goal)
            for letter in typed_letters(node_run)]


def turn_of(letter: TypedLetter, commands: Any, heading: Quantity, series: Optional[Series],
            goal: Optional[Series]) -> NodeTurn:
    """Returns the NodeTurn of a letter. The node uses the quantity `heading`; its variable for the
    heading is `series`. `goal` is the variable goal_yaw. If it is None, the letter gives the goal.
    """
    begin, end, _, side = letter
    begin_yaw = series.at(begin) if series is not None else float(heading.at(np.array([begin]))[0])
    read_at = begin
    goal_before = goal_after = ''
    if goal is not None:
        # goal_yaw changes when the node reads the letter
        changes = goal.between(begin, min(end, begin + LETTER_DELAY)).changes
        read_at = float(changes[0]) if len(changes) else begin + READING_PERIOD
        goal_before, goal_after = goal.text_at(begin), goal.text_at(read_at + READING_PERIOD)
    is_after = commands.arrival > max(begin, read_at - 2.0 * READING_PERIOD)
    commands = commands.take(is_after & (commands.arrival < end))
    times, headings = commands.arrival, heading.at(commands.arrival)
    if goal is not None:
        last_moment = np.nextafter(end, 0.0)
        goals = np.array([goal.at(min(max(time, read_at) + READING_PERIOD, last_moment))
                          for time in times])
    else:
        goals = np.full(len(times), begin_yaw + side * TURN_DEG * heading.per_degree)
    difference = (goals - headings) / heading.per_degree
    if goal is None and not side:
        difference[:] = np.nan
    return NodeTurn(*letter, begin_yaw, goal_before, goal_after, times, commands.angular, goals,
                    headings, difference)
