"""The command that follows a device: a gamepad or a mouse.

A field of a command follows an axis, a button or a place of the mouse, as it was in one of the last
messages, times a number. This number is found from the commands; no list of mistakes is needed.
"""
import json
from typing import Any, Callable, Dict, Iterable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from tb3_labs.watch.broken_link import BrokenLink, Check, NodeRun
from tb3_labs.watch.quantities import RECENT, SOON, Quantity, ages, thinned
from tb3_labs.watch.variables import Series

#: A command changes within ANSWERED after an input [s]; one that is held for HELD [s] is answered.
ANSWERED, HELD = 0.5, 0.6
#: A field follows an input if this part of its values does: a callback that waited answers late.
#: A variable is read up to READ_LATER after its command [s], and not for each.
FOLLOWS, READ_LATER, READ_PART = 0.9, 0.04, 0.8


class Device(NamedTuple):
    """The messages of a pad or of a mouse: a row for each message, a column for each name."""

    time: np.ndarray
    value: np.ndarray
    names: Sequence[str]

    def place(self, row: np.ndarray) -> str:
        """Words on a row."""
        return ' and '.join(f'{name} at {value:g}' for name, value in zip(
            self.names, row) if value) or 'all inputs at 0'

    @property
    def changed(self) -> np.ndarray:
        """For each message: since when it has been the same [s]."""
        is_new = np.append(True, np.diff(self.value, axis=0).any(axis=1))[:len(self.time)]
        return np.maximum.accumulate(np.where(is_new, self.time, -np.inf))

    def sample(self, time: np.ndarray) -> np.ndarray:
        """The index of the last message at each time; -1: there was none within RECENT [s]."""
        last = np.searchsorted(self.time, time + SOON) - 1
        return np.where(time - np.append(self.time, -np.inf)[last] <= RECENT, last, -1)

    def held(self) -> Iterable[Tuple[float, float, np.ndarray]]:
        """(begin, end, row) of each time in which nothing changed for HELD [s]."""
        begins = np.unique(self.changed)
        for begin, end in zip(begins, np.append(begins[1:], self.time[-1:])):
            if end - begin >= HELD:
                yield float(begin), float(end), self.value[np.searchsorted(self.time, begin)]


def events_of(node_run: NodeRun, kind: str) -> List[Tuple[float, Dict[str, Any]]]:
    """The events of this kind in a trial, with their times."""
    events = node_run.run.events
    return [(at, event) for at, words in zip(events.arrival, events.words)
            for event in [json.loads(words)] if event['kind'] == kind]


def stimulus(node_run: NodeRun, name: str) -> float:
    """The time at which a stimulus of a trial began; infinite if there was none."""
    states = node_run.run.states
    return float(dict(zip(states.words[::-1], states.arrival[::-1])).get(name, np.inf))


def factor_of(series: Series, form: Quantity, part: float) -> float:
    """The number by which a series is a form times a number; NaN if it is not."""
    last = form.value[(np.searchsorted(form.time, series.time + SOON) - 1).clip(0)]
    both = (series.value != 0.0) & (last != 0.0)
    if both.sum() < 3:
        return np.nan
    ratios, counts = np.unique(np.round(series.value[both] / last[both], 6), return_counts=True)
    factor = float(ratios[np.argmax(counts)])
    few = thinned(series.take((series.value != 0.0) | (last != 0.0)))
    times = form._replace(value=factor * form.value, scale=max(abs(factor), 1e-6))
    return factor if np.mean(np.isfinite(ages(few, times))) >= part else np.nan


def wrong_factor(node_run: NodeRun, device: Device, commands: Any, name: str,
                 forms: List[Quantity], factor: float) -> Optional[BrokenLink]:
    """The BrokenLink of a field, linear.x or angular.z, that should be `factor` times the first of
    the forms. It is weak if the field has the right sign and is not larger."""
    last, value = device.sample(commands.arrival), getattr(commands, name.split('.')[0])
    series, last = Series(name, commands.arrival, value, value).take(last >= 0), last[last >= 0]
    right = forms[0]
    wanted = factor * right.value[last]
    if not wanted.any():
        return None
    own = [Quantity(each.name, each.time - READ_LATER, each.value, 1.0)
           for each in node_run.variables.values() if len(set(each.text)) > 5
           and np.isfinite(each.value).all() and 'cmd' not in each.name]
    # forms may be equal by what happened: the handout's number is the likely one, then its form
    found = [sorted((abs(share - factor), order, share, form.words) for order, form in enumerate(
                        some) for share in [factor_of(series, form, part)] if np.isfinite(share))
             for some, part in ((forms, FOLLOWS), (own, READ_PART))]
    _, _, share, words = (found[0] + found[1] or [(0.0, 0, 0.0, '')])[0]
    if words == right.words and abs(share / factor - 1.0) < 0.02:
        return None
    settled = series.time - device.changed[last] > ANSWERED
    is_weak = (series.value * wanted > 0.0) & (np.abs(series.value) < 1.02 * abs(factor))
    if words:
        wrong, text = series.value != 0.0, f'follows {share:.3g} times {words}'
    else:
        wrong = settled & ~np.isfinite(ages(series, right._replace(
            value=factor * right.value, scale=abs(factor))))
        if wrong.sum() < max(3.0, (1.0 - FOLLOWS) * (settled & (wanted != 0.0)).sum()):
            return None
        row = device.value[last[np.argmax(wrong)]]
        here = settled & (device.value[last] == row).all(axis=1)
        text = 'was {:.2g} in {} of {} commands with {}'.format(
            series.value[np.argmax(wrong)], (here & wrong).sum(), here.sum(), device.place(row))
        if (here & ~wrong).sum() > 2 and not series.value[here & wrong].any():
            text += ', as if another callback published, too'
    return BrokenLink('{} {}; it should be {:g} times {}'.format(
        name, text, factor, right.words), float(series.time[np.argmax(wrong)]), name,
            bool(is_weak[settled & ((wanted != 0.0) | (series.value != 0.0))].all()))


def unanswered(sent: Any, device: Device, drives: Callable[[np.ndarray], Any],
               is_off: Callable[[float, float], Any]) -> Optional[BrokenLink]:
    """Does a command come while an input is held, and a zero when it is let go? ``drives(row)``: it
    asks for a movement; ``is_off(begin, end)``: none is to come."""
    speeds = np.abs(sent.linear) + np.abs(sent.angular)
    for begin, end, row in device.held():
        before, soon, last = np.searchsorted(sent.arrival, (begin + SOON, begin + ANSWERED, end))
        is_driven = before and speeds[before - 1] and begin - sent.arrival[before - 1] < RECENT
        if is_off(begin, end):
            continue
        if drives(row) and before == last:
            return BrokenLink('with {} nothing came on cmd_vel for {:.1f} s'.format(
                device.place(row), end - begin), begin)
        if not drives(row) and is_driven and (soon == before or speeds[soon - 1]):
            return BrokenLink('no zero velocity followed with {}: {} commands came in {:g} '
                              's'.format(
                                  device.place(row), soon - before, ANSWERED), begin)
    return None


def link_of(laws: Callable[[NodeRun], List[Optional[BrokenLink]]], weak: bool) -> Check:
    """The link that is broken by the first of the laws that is weak, or that is not."""
    return lambda node_run: next((each for each in node_run.cached(laws)
                                  if each is not None and each.is_weak == weak), None)
