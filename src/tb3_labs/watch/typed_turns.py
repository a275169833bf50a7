"""Finds the turns of a node in the IMU lab from the node's own variables."""
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, List, Optional

import numpy as np

from tb3_labs.geometry.arrays import index_before, wrap_all
from tb3_labs.handout import LEFT_KEY, MOUSE_DEAD_ZONE, RIGHT_KEY, TURN_DEG
from tb3_labs.watch.headings import followed_quantity, heading_candidates
from tb3_labs.watch.mistake import MAX_COMMAND_PAUSE, NodeRun
from tb3_labs.watch.variables import Quantity, Series

MAX_LETTER_DELAY = 3.0      # [s] until the node reads a typed letter
#: The probe reads a node's variables about once in this time [s].
READING_PERIOD = 0.06
#: The probe may show a change up to this time [s] after the node made the change.
MAX_READING_DELAY = 2.0 * READING_PERIOD
UNKNOWN_LETTER = 'a letter'
LETTER_OF_SIDE = {1.0: LEFT_KEY, -1.0: RIGHT_KEY, 0.0: ''}      # for the numbers of RunData.letters
TURN_OF_LETTER_DEG = {LEFT_KEY: TURN_DEG, RIGHT_KEY: -TURN_DEG, UNKNOWN_LETTER: np.nan}


@dataclass(frozen=True)
class NodeTurn:
    """The turn after a typed letter, until the next letter. `letter` is l, r or UNKNOWN_LETTER. A
    turn `is_cut` if the mouse moved, or the node ended, before the next letter was typed.

    Angles are in the node's own unit. `begin_yaw` is curr_yaw when the letter was typed.
    `goal_before` and `goal_after` are the texts of goal_yaw before and after the node read the
    letter. Both texts are '' if the node has no goal_yaw. The arrays have a value for each command
    of the turn: `command` is angular.z, `goal` is goal_yaw, and `heading` is curr_yaw. `difference`
    is goal_yaw minus curr_yaw [deg], or NaN if the goal is not known.
    """

    begin: float
    end: float
    is_cut: bool
    letter: str
    begin_yaw: float
    goal_before: str
    goal_after: str
    time: np.ndarray
    command: np.ndarray
    goal: np.ndarray
    heading: np.ndarray
    difference: np.ndarray

    @property
    def error(self) -> np.ndarray:
        """goal_yaw minus curr_yaw [deg] at each command, wrapped to (-180, 180]."""
        return wrap_all(self.difference, 360.0)

    @property
    def moving_indices(self) -> np.ndarray:
        """The indices of the commands that turn the robot."""
        return np.flatnonzero(self.command)

    @property
    def is_ended(self) -> bool:
        """A zero follows the last command that turns the robot."""
        return len(self.moving_indices) > 0 and not self.command[-1]

    @property
    def lacks_zero(self) -> bool:
        """No zero follows the last command that turns the robot, for longer than a pause."""
        is_moving = len(self.moving_indices) > 0 and not self.is_ended
        return is_moving and self.end - self.time[-1] > MAX_COMMAND_PAUSE

    def command_text(self, index: int) -> str:
        """Returns a clause on the command at this index and its error. If the difference is more
        than half a turn, the clause has both the difference and the wrapped error."""
        difference, error = self.difference[index], self.error[index]
        clause = f'for an error of {error:+.0f} degrees'
        if abs(difference) > 180.0:
            clause = (f'goal_yaw {self.goal[index]:.4g} minus curr_yaw {self.heading[index]:.4g} '
                      f'is {difference:+.0f}, by the short way {error:+.0f} degrees:')
        return f'{clause} the command was {self.command[index]:+.2f} rad/s'


@lru_cache(maxsize=1)
def quantity_of_curr_yaw(node_run: NodeRun) -> Optional[Quantity]:
    series = node_run.variable('curr_yaw')
    if series is None:
        return None
    return followed_quantity(series, heading_candidates(node_run))


def own_heading(node_run: NodeRun) -> Optional[Quantity]:
    """Returns the usable heading that curr_yaw follows, or None."""
    followed = quantity_of_curr_yaw(node_run)
    if followed is None or not followed.per_degree:
        return None
    return followed


@lru_cache(maxsize=1)
def letter_turns(node_run: NodeRun) -> List[NodeTurn]:
    """Returns the NodeTurn of each l or r. Without letters, `turning` shows when turns begin."""
    recording = node_run.recording
    times = recording.letters.arrival
    letters = [LETTER_OF_SIDE[side] for side in recording.letters.value]
    if not len(times):
        times = unrecorded_letters(node_run)
        letters = [UNKNOWN_LETTER] * len(times)
    turns = []
    for begin, letter, end in zip(times, letters, [*times[1:], recording.duration]):
        node_end = node_run.last_reading_before_gap(begin)
        turn_end = min(mouse_moved_at(recording.mouse, begin), node_end, end)
        if letter and turn_end > begin:
            turns.append(turn_of(node_run, begin, turn_end, letter, is_cut=turn_end < end))
    return turns


def mouse_moved_at(mouse: Any, begin: float) -> float:
    """Returns the time of the first message by which the mouse drives the robot, or inf if no
    message does. The search starts with the last message before `begin`."""
    index_at_begin = max(index_before(mouse.arrival, begin), 0)
    mouse = mouse.take(slice(index_at_begin, None))
    is_outside_dead_zone = np.maximum(np.abs(mouse.x), np.abs(mouse.y)) > MOUSE_DEAD_ZONE
    return float(min(mouse.arrival[is_outside_dead_zone & (mouse.active > 0.0)], default=np.inf))


def unrecorded_letters(node_run: NodeRun) -> np.ndarray:
    """Returns the times at which `turning` became True. Returns no times if goal_yaw changes in a
    turn, because such a node reads several letters in one turn."""
    turning = node_run.boolean_variable('turning')
    goal = node_run.variable('goal_yaw')
    if turning is None:
        return np.empty(0)
    goal_changes = np.empty(0) if goal is None else goal.changes
    for time in goal_changes:
        if turning.at(time - MAX_READING_DELAY) and turning.at(time):
            return np.empty(0)
    becomes_true = np.diff(turning.value) > 0.0
    return turning.time[1:][becomes_true] - MAX_READING_DELAY


def turn_of(node_run: NodeRun, begin: float, end: float, letter: str, is_cut: bool) -> NodeTurn:
    """Returns the NodeTurn of a letter. If curr_yaw is not a usable heading, the correct heading
    and the correct goal are used in place of curr_yaw and goal_yaw."""
    heading = own_heading(node_run)
    curr_yaw = node_run.variable('curr_yaw')
    if heading is not None and curr_yaw is not None:
        begin_yaw = float(curr_yaw.at(begin))
        goal_yaw = node_run.variable('goal_yaw')
    else:
        heading = heading_candidates(node_run)[0]
        begin_yaw = float(heading.at(begin))
        goal_yaw = None

    read_at = begin if goal_yaw is None else letter_read_at(goal_yaw, begin, end)
    arrival = node_run.commands.arrival
    is_after = arrival > max(begin, read_at - MAX_READING_DELAY)
    commands = node_run.commands.take(is_after & (arrival < end))
    times = commands.arrival
    yaws = heading.at(times)

    if goal_yaw is None:
        goal_before, goal_after = '', ''
        goals = np.full(len(times), begin_yaw + TURN_OF_LETTER_DEG[letter] * heading.per_degree)
    else:
        goal_before = goal_yaw.text_at(begin)
        goal_after = goal_yaw.text_at(read_at + READING_PERIOD)
        shown_at = np.maximum(times, read_at) + READING_PERIOD
        last_moment = np.nextafter(end, 0.0)    # at `end` the next letter has changed the goal
        goals = goal_yaw.at(np.minimum(shown_at, last_moment))
    return NodeTurn(
        begin=begin, end=end, is_cut=is_cut, letter=letter, begin_yaw=begin_yaw,
        goal_before=goal_before, goal_after=goal_after, time=times, command=commands.angular,
        goal=goals, heading=yaws, difference=(goals - yaws) / heading.per_degree)


def letter_read_at(goal_yaw: Series, begin: float, end: float) -> float:
    """Returns the time [s] at which the node read a letter, and so changed its goal_yaw."""
    changes = goal_yaw.between(begin, min(end, begin + MAX_LETTER_DELAY)).changes
    return float(changes[0]) if len(changes) else begin + READING_PERIOD
