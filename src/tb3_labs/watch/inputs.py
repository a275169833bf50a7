"""The command that follows a device: a gamepad or a mouse.

A field of a command follows an axis, a button or a place of the mouse, as it was in one of the last
messages, times a number. This number is found from the commands; no list of mistakes is needed.
"""
import json
from typing import Any, Callable, Dict, Iterable, List, NamedTuple, Optional, Tuple

import numpy as np

from tb3_labs.watch.chain import Broken, Inside, Look
from tb3_labs.watch.quantities import RECENT, SOON, Quantity, ages, thinned
from tb3_labs.watch.turn_links import wrong_field
from tb3_labs.watch.variables import Series

#: A command has changed within ANSWERED after an input [s]; an input that is held for HELD [s] must
#: have been answered.
ANSWERED, HELD = 0.5, 0.6
#: A field follows an input if this part of its values does: a callback that waited answers late.
#: It follows a variable, which is read up to READ_LATER after it [s], if READ_PART of them do.
FOLLOWS, READ_LATER, READ_PART = 0.9, 0.04, 0.8
#: The stimulus at which a node ends.
END = 'Ctrl+C'


class Device(NamedTuple):
    """What a node heard of a pad or of a mouse: `value` has a row for each message.
    ``place(row)``: words on a row."""

    time: np.ndarray
    value: np.ndarray
    place: Callable[[np.ndarray], str]

    @property
    def changed(self) -> np.ndarray:
        """For each message: since when it has been the same [s]."""
        first = np.append(True, (np.diff(self.value, axis=0) != 0.0).any(axis=1))
        return self.time[np.maximum.accumulate(np.where(first, np.arange(len(first)), 0))]

    def sample(self, time: np.ndarray) -> np.ndarray:
        """The index of the last message at each time; -1: there was none within RECENT [s]."""
        last = np.searchsorted(self.time, time + SOON) - 1
        return np.where((last >= 0) & (time - self.time[last] <= RECENT), last, -1)

    def held(self) -> Iterable[Tuple[float, float, np.ndarray]]:
        """(begin, end, row) of each time in which nothing changed for HELD [s]."""
        begins = np.unique(self.changed) if len(self.time) else self.time
        for begin, end in zip(begins, np.append(begins[1:], self.time[-1:])):
            if end - begin >= HELD:
                yield float(begin), float(end), self.value[np.searchsorted(self.time, begin)]


def events(inside: Inside, kind: str) -> List[Tuple[float, Dict[str, Any]]]:
    """The events of this kind in a trial, with their times."""
    found = [(float(at), json.loads(words)) for at, words in zip(
        inside.run.events.arrival, inside.run.events.words)]
    return [(at, event) for at, event in found if event['kind'] == kind]


def stimulus(inside: Inside, name: str) -> float:
    """The time at which a stimulus of a trial began; infinite if there was none."""
    states = inside.run.states
    return float(states.arrival[states.words == name].min(initial=np.inf))


def sent(inside: Inside) -> Any:
    """The commands, without those after the end of a node."""
    run = inside.run
    kept = np.ones(len(run.commands), bool)
    for at, words in zip(run.states.arrival, run.states.words):
        if words.startswith(END):
            again = min((start for start in run.starts if start > at), default=np.inf)
            kept &= (run.commands.arrival < at) | (run.commands.arrival > again)
    return run.commands.take(kept)


def factor_of(series: Series, form: Quantity, part: float = FOLLOWS) -> float:
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


def own_variable(inside: Inside, series: Series) -> str:
    """Words on the node's variable that a field follows; '' if there is none."""
    later = Series(series.name, series.time + READ_LATER, series.text, series.value)
    for each in inside.variables.values():
        if len(set(each.text)) > 5 and np.isfinite(each.value).all() and 'cmd' not in each.name:
            factor = factor_of(later, Quantity('', each.time, each.value, 1.0), READ_PART)
            if np.isfinite(factor):
                return '; it follows {:.3g} times {}'.format(factor, each.name)
    return ''


def law(inside: Inside, device: Device, commands: Any, name: str, inputs: List[List[Quantity]],
        factor: float) -> Optional[Broken]:
    """The Broken of a field, linear.x or angular.z, that should be `factor` times the first form of
    the first input. It is weak if the field has the right sign and is not larger."""
    value, last = getattr(commands, name.split('.')[0]), device.sample(commands.arrival)
    series, last = Series(name, commands.arrival, value, value).take(last >= 0), last[last >= 0]
    right = inputs[0][0]
    wanted = factor * right.value[last]
    if not wanted.any():
        return None
    should = '; it should be {:g} times {}'.format(factor, right.words)
    found = [[(share, form.words) for form in forms for share in [factor_of(series, form)]
              if np.isfinite(share)] for forms in inputs]
    equal = [each[0] for each in found if each]
    if equal:
        share = equal[0][0] / factor if equal[0][1] == right.words else 0.0
        first = int(np.argmax(series.value != 0.0))
        return None if abs(share - 1.0) < 0.02 else Broken('{} follows {}{}'.format(
            name, ', or '.join('{:.3g} times {}'.format(*each) for each in equal[:2]), should),
            float(series.time[first]), name, 0.0 < share < 1.0)
    if not series.value.any():
        first = int(np.argmax(np.abs(wanted)))
        return Broken('; '.join(filter(None, ('{} stayed 0, also with {}{}'.format(
            name, device.place(device.value[last[first]]), should), wrong_field(commands)))),
            float(series.time[first]), name)
    asked = right._replace(value=factor * right.value, scale=abs(factor))
    settled = series.time - device.changed[last] > ANSWERED
    wrong = settled & ~np.isfinite(ages(series, asked))
    if wrong.sum() < max(3.0, (1.0 - FOLLOWS) * (settled & (wanted != 0.0)).sum()):
        return None
    first = int(np.argmax(wrong))
    here = settled & (device.value[last] == device.value[last[first]]).all(axis=1)
    is_mixed = (here & ~wrong).sum() > 2 and not series.value[here & wrong].any()
    is_weak = (series.value * wanted > 0.0) & (np.abs(series.value) < 1.02 * abs(factor))
    return Broken('with {} {} was {:.2g} in {} of {} commands{}{}: {:.2g}{}'.format(
        device.place(device.value[last[first]]), name, series.value[first],
        (here & wrong).sum(), here.sum(), ', another callback publishes, too' * is_mixed, should,
        wanted[first], own_variable(inside, series)),
        float(series.time[first]), name, bool(is_weak[wrong].all()))


def no_zero(commands: Any, begin: float, words: str) -> Optional[Broken]:
    """Does a zero follow within ANSWERED after `begin`, at which a driven robot should stop?"""
    speeds = np.abs(commands.linear) + np.abs(commands.angular)
    before, soon = np.searchsorted(commands.arrival, (begin + SOON, begin + ANSWERED))
    is_driven = before and speeds[before - 1] and begin - commands.arrival[before - 1] < RECENT
    if not is_driven or soon > before and not speeds[soon - 1]:
        return None
    return Broken('no zero velocity followed {}: {}'.format(
        words, 'no command came' if soon == before else
        '{:.1f} s later the command was {:.2f} m/s and {:.2f} rad/s'.format(
            ANSWERED, commands.linear[soon - 1], commands.angular[soon - 1])), begin)


def unanswered(commands: Any, device: Device, drives: Callable[[np.ndarray], Any],
               is_off: Callable[[float, float], Any]) -> Optional[Broken]:
    """Does a command come while an input is held, and a zero when it is let go? ``drives(row)``: it
    asks for a movement; ``is_off(begin, end)``: none is to come."""
    for begin, end, row in device.held():
        if is_off(begin, end):
            continue
        first, last = np.searchsorted(commands.arrival, (begin, end))
        if not drives(row):
            found = no_zero(commands, begin, 'with ' + device.place(row))
        else:
            found = Broken('with {} nothing came on cmd_vel for {:.1f} s'.format(
                device.place(row), end - begin), begin) if first == last else None
        if found:
            return found
    return None


def link_of(laws: Callable[[Inside], List[Optional[Broken]]], weak: bool) -> Look:
    """The link that is broken by the first of the laws that is weak, or that is not."""
    return lambda inside: next((each for each in inside.known(laws)
                                if each is not None and each.is_weak == weak), None)
