"""The command that follows a device: a gamepad or a mouse.

An input is an axis, a button or a coordinate of the mouse. A field of a command follows an input if
the field is a constant factor times the input of a recent message. The factor is found from the
commands.
"""
import json
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from tb3_labs.watch.broken_link import BrokenLink, Check, NodeRun, expected
from tb3_labs.watch.quantities import ARRIVAL_LEAD, RECENT_TIME, Quantity, sample_ages, subsampled
from tb3_labs.watch.variables import Series, last_before

#: A command follows an input within this time [s].
ANSWER_DELAY = 0.5
#: If an input does not change for this time, a node must answer it [s].
HELD_TIME = 0.6
#: A field follows an input if this share of its values does. The share is not 1, because a delayed
#: callback answers late.
INPUT_SHARE = 0.9
#: The probe reads a variable up to this time after its command [s].
READING_DELAY = 0.04
#: A field follows a variable if this share of its values does. Some commands have no reading.
VARIABLE_SHARE = 0.8


class Device(NamedTuple):
    """The messages of a pad or of a mouse: a row for each message, a column for each name."""

    time: np.ndarray
    value: np.ndarray
    names: Sequence[str]

    def row_text(self, row: np.ndarray) -> str:
        """Returns the names and values of the inputs that are not 0."""
        return ' and '.join(f'{name} at {value:g}' for name, value in zip(
            self.names, row) if value) or 'all inputs at 0'

    @property
    def same_since(self) -> np.ndarray:
        """For each message, the time of the last change of any input until then [s]."""
        is_new = np.append(True, np.diff(self.value, axis=0).any(axis=1))[:len(self.time)]
        return np.maximum.accumulate(np.where(is_new, self.time, -np.inf))

    def index_at(self, times: np.ndarray) -> np.ndarray:
        """Returns the index of the last message before each time; -1 without a recent message."""
        last = last_before(self.time, times + ARRIVAL_LEAD)
        age = times - np.append(self.time, -np.inf)[last]
        return np.where(age <= RECENT_TIME, last, -1)

    def held_inputs(self) -> Iterator[Tuple[float, float, np.ndarray]]:
        """Yields (begin, end, row) of each interval in which no input changed for HELD_TIME."""
        begins = np.unique(self.same_since)
        for begin, end in zip(begins, np.append(begins[1:], self.time[-1:])):
            if end - begin >= HELD_TIME:
                yield float(begin), float(end), self.value[np.searchsorted(self.time, begin)]


def events_of(node_run: NodeRun, kind: str) -> List[Tuple[float, Dict[str, Any]]]:
    """Returns (time, event) of each event of this kind that was recorded in a trial."""
    rows = node_run.run.events
    events = [(time, json.loads(text)) for time, text in zip(rows.arrival, rows.text)]
    return [(time, event) for time, event in events if event['kind'] == kind]


def stimulus_begin(node_run: NodeRun, name: str) -> float:
    """Returns the time at which the stimulus `name` of a trial began; inf if it did not begin."""
    states = node_run.run.states
    for begin, text in zip(states.arrival, states.text):
        if text == name:
            return float(begin)
    return np.inf


def factor_of(series: Series, form: Quantity, share: float) -> float:
    """Returns the factor by which `form` must be multiplied so that this share of the series
    follows the product; NaN if there is no such factor."""
    last = form.at(series.time + ARRIVAL_LEAD)
    both = (series.value != 0.0) & (last != 0.0)
    if both.sum() < 3:
        return np.nan
    ratios, counts = np.unique(np.round(series.value[both] / last[both], 6), return_counts=True)
    factor = float(ratios[np.argmax(counts)])
    product = multiplied(form, factor)
    some = subsampled(series.take((series.value != 0.0) | (last != 0.0)))
    is_following = np.isfinite(sample_ages(some, product))
    return factor if is_following.mean() >= share else np.nan


def multiplied(form: Quantity, factor: float) -> Quantity:
    return form._replace(value=factor * form.value, scale=max(abs(factor), 1e-6))


def followed_form(series: Series, forms: Sequence[Quantity], share: float,
                  factor: float) -> Optional[Tuple[float, str]]:
    """Returns (factor, name) of the form that a series follows, or None. If it follows several
    forms, the form whose factor is nearest to the handout's `factor` is chosen."""
    factors = [(factor_of(series, form, share), form.name) for form in forms]
    found = [each for each in factors if np.isfinite(each[0])]
    return min(found, key=lambda each: abs(each[0] - factor)) if found else None


def wrong_factor(node_run: NodeRun, device: Device, commands: Any, name: str,
                 forms: List[Quantity], factor: float) -> Iterator[BrokenLink]:
    """Yields the field `name`, linear.x or angular.z, if it is not `factor` times the first of the
    forms. The BrokenLink is weak if the field has the correct sign and is not too large."""
    index, value = device.index_at(commands.arrival), getattr(commands, name.split('.')[0])
    series, index = Series(name, commands.arrival, value, value).take(index >= 0), index[index >= 0]
    correct = forms[0]
    wanted = factor * correct.value[index]
    if not wanted.any():
        return
    is_settled = series.time - device.same_since[index] > ANSWER_DELAY
    own = [Quantity(each.name, each.time - READING_DELAY, each.value, 1.0)
           for each in node_run.variables.values() if len(set(each.text)) > 5
           and np.isfinite(each.value).all() and 'cmd' not in each.name]
    followed = followed_form(series, forms, INPUT_SHARE, factor) or followed_form(
        series, own, VARIABLE_SHARE, factor)
    if followed is not None:
        number, followed_name = followed
        if followed_name == correct.name and abs(number / factor - 1.0) < 0.02:
            return
        is_wrong, text = series.value != 0.0, f'follows {number:.3g} times {followed_name}'
    else:
        is_wrong = is_settled & ~np.isfinite(sample_ages(series, multiplied(correct, factor)))
        driven = is_settled & (wanted != 0.0)
        if is_wrong.sum() < max(3.0, (1.0 - INPUT_SHARE) * driven.sum()):
            return
        text = wrong_commands_text(device, index, series.value, is_wrong, is_settled)
    keeps_side = (series.value * wanted > 0.0) & (np.abs(series.value) < 1.02 * abs(factor))
    is_judged = is_settled & ((wanted != 0.0) | (series.value != 0.0))
    yield BrokenLink(expected(f'{name} {text}', f'{factor:g} times {correct.name}'),
                     series.time[np.argmax(is_wrong)], name,
                     is_weak=keeps_side[is_judged].all())


def wrong_commands_text(device: Device, index: np.ndarray, value: np.ndarray,
                        is_wrong: np.ndarray, is_settled: np.ndarray) -> str:
    """Returns a clause: the `value` of the first wrong command, and how many of the commands with
    the same inputs are wrong. Command k belongs to message ``index[k]``."""
    first = np.argmax(is_wrong)
    inputs = device.value[index[first]]
    is_same = is_settled & (device.value[index] == inputs).all(axis=1)
    return 'was {:.2g} in {} of {} commands with {}'.format(
        value[first], (is_same & is_wrong).sum(), is_same.sum(), device.row_text(inputs))


def unanswered(commands: Any, device: Device, drives: Callable[[np.ndarray], Any],
               is_ignored: Callable[[float, float], Any]) -> Iterator[BrokenLink]:
    """Yields held inputs that no command answers, and released inputs that no zero command answers.

    ``drives(row)`` is true if the inputs of this row ask for a movement. ``is_ignored(begin, end)``
    is true if the node may be silent in this time.
    """
    times, speeds = commands.arrival, np.abs(commands.linear) + np.abs(commands.angular)
    for begin, end, row in device.held_inputs():
        if is_ignored(begin, end):
            continue
        inputs = device.row_text(row)
        before, soon, last = np.searchsorted(
            times, (begin + ARRIVAL_LEAD, begin + ANSWER_DELAY, end))
        is_moving = before and speeds[before - 1] and begin - times[before - 1] < RECENT_TIME
        if drives(row) and before == last:
            yield BrokenLink(
                f'with {inputs} nothing came on cmd_vel for {end - begin:.1f} s', begin)
        if not drives(row) and is_moving and (soon == before or speeds[soon - 1]):
            yield BrokenLink(f'no zero velocity followed with {inputs}: {soon - before} commands '
                             f'came in {ANSWER_DELAY:g} s', begin)


def law_link(laws: Callable[[NodeRun], List[BrokenLink]], weak: bool) -> Check:
    """Returns a Check that yields the weak BrokenLinks of `laws`, or the others if not `weak`."""
    return lambda node_run: (each for each in node_run.cached(laws) if each.is_weak == weak)
