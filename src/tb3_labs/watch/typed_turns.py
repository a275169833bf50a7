"""The turns of a run as its node had them: the letter, the goal, each command with its error."""
from dataclasses import dataclass, replace
from typing import List, Optional, Tuple

import numpy as np

from tb3_labs.handout import MOUSE_DEAD_ZONE, TURN_DEG
from tb3_labs.watch.broken_link import BrokenLink, NodeRun, belief, is_heading
from tb3_labs.watch.quantities import Quantity, matching_quantities
from tb3_labs.watch.variables import Series

#: A letter is read within ANSWERED [s]. The variables are read every READ [s].
ANSWERED, READ = 3.0, 0.06


@dataclass(frozen=True)
class Turn:
    """A letter that was typed, and the turn after it, until the next letter. The turn `is_cut` if
    before this the mouse is moved, or the node ends. `side`: 1 for l, -1 for r, 0 if unknown.

    Angles in the node's own unit: `own`, curr_yaw at the letter; `before` and `after`, goal_yaw as
    a text, '' if there is none. Of each command: its time, angular.z, goal_yaw and curr_yaw then,
    and their difference [deg], NaN if the goal is not known.
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
        return self.difference - 360.0 * np.round(self.difference / 360.0)

    @property
    def moving(self) -> np.ndarray:
        """The indices of the commands that turn."""
        return np.flatnonzero(self.command)

    def moment_text(self, k: int) -> str:
        """Words on a command: how its error was wrapped, if it had to be."""
        words = f'for an error of {self.error[k]:+.0f} degrees'
        if abs(self.difference[k]) > 180.0:
            words = 'goal_yaw {:.4g} minus curr_yaw {:.4g} is {:+.0f}, by the short way {:+.0f} ' \
                'degrees:'.format(self.goal[k], self.heading[k], self.difference[k], self.error[k])
        return f'{words} the command was {self.command[k]:+.2f} rad/s'


def heading(node_run: NodeRun) -> Tuple[Optional[Series], Optional[Quantity], Optional[BrokenLink]]:
    """(the variable for the heading, the quantity that it follows, the BrokenLink if it is
    wrong)."""
    series = node_run.find('curr_yaw')
    if series is not None and matching_quantities(series, [node_run.heading]):
        return series, node_run.heading, None
    quantities = node_run.imu
    if series is None:      # another name
        found = [(each, matching_quantities(each, quantities))
                 for each in node_run.variables.values()
                 if 'goal' not in each.name and np.isfinite(each.value).any()
                 and np.nanmax(each.value) - np.nanmin(each.value) > 0.5]
        found.sort(key=lambda each: not (each[1] and is_heading(each[1][0], quantities[0])))
        series = next((each for each, matching in found if matching), None)
    if series is None:
        return None, None, None
    follows, broken = belief(series, quantities)
    since = since_another_zero(series, node_run.heading) if broken and (
        'does not follow' in broken.words) else None
    return (series, since, None) if since else (series, follows, broken)


def since_another_zero(series: Series, right: Quantity) -> Optional[Quantity]:
    """The heading from another zero, as from that at the node's start, if a variable follows it: a
    turn needs no more."""
    now = right.value[(np.searchsorted(right.time, series.time) - 1).clip(0)]
    for unit in (1.0, np.pi / 180.0):
        apart = np.exp(1j * np.radians(series.value / unit - now))
        zero = np.degrees(np.angle(np.nanmedian(apart.real) + 1j * np.nanmedian(apart.imag)))
        # an angle is compared on the unit circle
        circle = replace(series, value=np.exp(1j * np.radians(series.value / unit - zero)))
        same = right._replace(value=np.exp(1j * np.radians(right.value)), scale=60.0)
        if matching_quantities(circle, [same]):
            return right._replace(words='the heading from another zero', per_degree=unit,
                                  value=(right.value + zero) % 360.0 * unit)
    return None


def new_aims(turning: Series, goal: Optional[Series]) -> np.ndarray:
    """The times at which goal_yaw had become another one at once, while `turning` stayed True: the
    next letter of a queue, or one that was typed in a turn."""
    if goal is None or not len(goal.time):
        return np.empty(0)
    is_new = goal.text[1:] != goal.text[:-1]
    # a goal that goes on and on is a mistake
    alone = is_new & ~np.append(False, is_new[:-1]) & ~np.append(is_new[1:], False)
    return np.array([at for at in goal.time[1:][alone] if turning.at(at - 2.0 * READ) == 1.0
                     and turning.at(at) == 1.0])


def aims_without_turn(node_run: NodeRun, turning: Series, goal: Optional[Series]) -> np.ndarray:
    """The times at which goal_yaw had become TURN_DEG from curr_yaw, and `turning` was not seen to
    be True."""
    series, quantity, _ = node_run.cached(heading)
    found: List[float] = []
    if goal is None or series is None or quantity is None:
        return np.array(found)
    for at in goal.changes:
        off = abs((goal.at(at) - series.at(at)) / quantity.per_degree)
        near = turning.between(at - 2.0 * READ, at + 8.0 * READ).value
        if len(near) > 5 and not near.any() and min(
                abs(off - TURN_DEG), abs(360.0 - off - TURN_DEG)) < 1.0:
            found.append(float(at))
    return np.array(found)


def letters(node_run: NodeRun) -> List[Tuple[float, float, bool, int]]:
    """(begin, end, is_cut, side) of each letter, as it was typed, else as `turning` or `goal_yaw`
    tell."""
    typed, turning, goal = node_run.run.letters, node_run.flag('turning'), node_run.find('goal_yaw')
    if len(typed):
        times, sides = typed.arrival, typed.value
    elif turning is not None:
        times = np.union1d(turning.time[1:][np.diff(turning.value) > 0.0] - 2.0 * READ,
                           new_aims(turning, goal))
        times = np.union1d(times, aims_without_turn(node_run, turning, goal) - 2.0 * READ)
        sides = np.zeros(len(times))
    else:
        times = goal.changes - 2.0 * READ if goal is not None else np.empty(0)
        sides = np.zeros(len(times))
    is_end = (sides == 0.0) & bool(len(typed))
    mouse = node_run.run.mouse
    drives = (mouse.active > 0.0) & (np.maximum(abs(mouse.x), abs(mouse.y)) >= MOUSE_DEAD_ZONE)
    found = []
    for begin, end, side, over in zip(times, np.append(times[1:], node_run.run.duration), sides,
                                      is_end):
        # the latest message of the mouse before the letter counts, too
        first, last = np.searchsorted(mouse.arrival, (begin, end))
        moved = mouse.arrival[max(first - 1, 0):last][drives[max(first - 1, 0):last]]
        cut = min(*moved[:1], node_run.end_after(begin), end)
        if cut > begin and not over:
            found.append((float(begin), float(cut), bool(cut < end), int(side)))
    return found


def turns(node_run: NodeRun) -> List[Turn]:
    """The turns of a run. Without goal_yaw their goals are those of the letters."""
    series, quantity, _ = node_run.cached(heading)
    used, goal, sent = quantity or node_run.heading, node_run.find('goal_yaw'), node_run.commands
    goal = goal if quantity is not None and goal is not None and len(goal.time) else None
    flag = node_run.flag('turning')
    if goal is not None and flag is not None and not len(node_run.run.letters):
        for at in new_aims(flag, goal):     # between two readings the aim is not known
            last = goal.time[np.searchsorted(goal.time, at) - 1]
            sent = sent.take((sent.arrival <= last) | (sent.arrival > at))
    found = []
    for begin, end, is_cut, side in letters(node_run):
        newest = max(0, int(np.searchsorted(used.time, begin)) - 1)
        own = series.at(begin) if series is not None and quantity is not None else float(
            used.value[newest])
        read = begin
        if goal is not None:        # it is read when goal_yaw changes, if it does
            changes = goal.between(begin, min(end, begin + ANSWERED)).changes
            read = float(changes[0]) if len(changes) else begin + READ
        chosen = (sent.arrival > max(begin, read - 2.0 * READ)) & (sent.arrival < end)
        time = sent.arrival[chosen]
        aim = np.full(len(time), own + side * TURN_DEG * used.per_degree) if goal is None else (
            np.array([goal.at(min(max(at, read) + READ, np.nextafter(end, 0.0))) for at in time]))
        now = used.value[(np.searchsorted(used.time, time) - 1).clip(0)]
        found.append(Turn(
            begin, end, is_cut, side, own, goal.text_at(begin) if goal is not None else '',
            goal.text_at(read + READ) if goal is not None else '', time, sent.angular[chosen], aim,
            now, (aim - now) / used.per_degree if side or goal is not None else np.nan * time))
    return found
