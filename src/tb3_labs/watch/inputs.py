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
#: A variable is read up to READ_LATER after the command that follows it [s], and this part of its
#: values is read.
READ_LATER, READ_PART = 0.07, 0.8
#: A field follows an input if this part of its values does: a callback that waited answers late.
FOLLOWS = 0.9
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
        before = np.vstack([np.full(self.value.shape[1], np.nan), self.value[:-1]])
        differs = (self.value != before[:len(self.value)]).any(axis=1)
        return self.time[np.maximum.accumulate(np.where(differs, np.arange(len(differs)), 0))]

    def sample(self, time: Any) -> np.ndarray:
        """The index of the last message at each time; -1: there was none within RECENT [s]."""
        last = np.searchsorted(self.time, np.asarray(time) + SOON) - 1
        return np.where((last >= 0) & (time - self.time[last] <= RECENT), last, -1)

    def held(self) -> Iterable[Tuple[float, float, np.ndarray]]:
        """(begin, end, row) of each time in which nothing changed for HELD [s]."""
        if not len(self.time):
            return
        begins = np.unique(self.changed)
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
    return min((float(at) for at, words in zip(states.arrival, states.words) if words == name),
               default=np.inf)


def sent(inside: Inside) -> Any:
    """The commands, without those after the end of a node."""
    run = inside.run
    kept = np.ones(len(run.commands), bool)
    for at, words in zip(run.states.arrival, run.states.words):
        if words.startswith(END):
            again = min((start for start in run.starts if start > at), default=np.inf)
            kept &= (run.commands.arrival < at) | (run.commands.arrival > again)
    return run.commands.take(kept)


def flag(inside: Inside, name: str) -> Optional[Series]:
    """The node's variable of this name if it is True or False; not a constant that is a number."""
    found = inside.find(name)
    return found if found is not None and set(found.value) <= {0.0, 1.0} and (
        len(found.changes) or set(found.text) <= {'True', 'False'}) else None


def factor_of(series: Series, form: Quantity) -> float:
    """The number by which a series is a form times a number; NaN if it is not."""
    last = form.value[(np.searchsorted(form.time, series.time + SOON) - 1).clip(0)]
    both = (series.value != 0.0) & (last != 0.0)
    if both.sum() < 3:
        return np.nan
    factor = float(np.median(series.value[both] / last[both]))
    few = thinned(series.take((series.value != 0.0) | (last != 0.0)))
    is_so = np.isfinite(ages(few, scaled(form, factor)))
    return factor if np.mean(is_so) >= FOLLOWS else np.nan


def scaled(form: Quantity, factor: float) -> Quantity:
    """A form times a number."""
    return Quantity(form.words, form.time, factor * form.value, max(abs(factor), 1e-6))


def own_variable(inside: Inside, series: Series) -> str:
    """Words on the node's variable that a field follows; '' if there is none."""
    few = thinned(series.take(series.value != 0.0))
    later = Series(few.name, few.time + READ_LATER, few.text, few.value)
    for each in inside.variables.values():
        if len(set(each.text)) > 5 and np.isfinite(each.value).all() and 'cmd' not in each.name:
            read = np.array([each.at(at) for at in few.time + READ_LATER / 2.0])
            ratios, number = np.unique(np.round(few.value[read != 0.0] / read[read != 0.0], 6),
                                       return_counts=True)
            factor = ratios[np.argmax(number)] if len(ratios) else 0.0
            if np.mean(np.isfinite(ages(later, scaled(Quantity(
                    each.name, each.time, each.value, 1.0), factor)))) > READ_PART:
                return '; it follows {:.3g} times {}'.format(factor, each.name)
    return ''


def law(inside: Inside, device: Device, commands: Any, name: str, forms: List[Quantity],
        factor: float) -> Optional[Broken]:
    """The Broken of a field, linear.x or angular.z, that should be `factor` times the first of the
    forms. It is weak if the field has the right sign and is not larger."""
    right, asked = forms[0], scaled(forms[0], factor)
    if not right.value.any():
        return None
    should = 'it should be {:g} times {}'.format(factor, right.words)
    value = getattr(commands, name.split('.')[0])
    series = Series(name, commands.arrival, value, value).take(
        device.sample(commands.arrival) >= 0)
    if not len(series.time):
        return None
    factors = [(factor_of(series, form), form.words) for form in forms]
    found = [each for each in factors if np.isfinite(each[0])]
    if found:
        share, words = found[0]
        moment = float(series.time[np.flatnonzero(series.value)[0]])
        is_usual = abs(share / factor - 1.0) < 0.02
        if words != right.words:    # one of another axis may be equal by this motion
            equal = found[:1] + [each for each in found if each[1][:6] != words[:6]
                                 and not is_usual][:1]
            return Broken('{} follows {}; {}'.format(name, ', or '.join(
                map('{0[0]:.3g} times {0[1]}'.format, equal)), should), moment, name)
        return None if is_usual else Broken(
            '{} is {:.3g} times {}, the handout has {:+g}'.format(
                name, share, words, factor), moment, name, 0.0 < share / factor < 1.0)
    last = device.sample(series.time)
    wanted = asked.value[last]
    settled = series.time - device.changed[last] > ANSWERED
    wrong = settled & ~np.isfinite(ages(series, asked))
    if not series.value.any():
        k = int(np.argmax(np.abs(wanted)))
        return Broken('; '.join(filter(None, ('{} stayed 0, also with {}'.format(
            name, device.place(device.value[last[k]])), should, wrong_field(commands)))),
            float(series.time[k]), name) if wanted.any() else None
    if wrong.sum() < max(3.0, (1.0 - FOLLOWS) * (settled & (wanted != 0.0)).sum()):
        return None
    k = int(np.flatnonzero(wrong)[0])
    here = settled & (device.value[last] == device.value[last[k]]).all(axis=1)
    place = device.place(device.value[last[k]])
    if (here & ~wrong).sum() > 2 and not series.value[here & wrong].any():
        words = '{} of {} commands with {} had {} 0: another callback publishes, too'.format(
            (here & wrong).sum(), here.sum(), place, name)
    else:
        words = 'with {} for {:.1f} s {} was {:.2g}, {}: {:.2g}'.format(
            place, series.time[k] - device.changed[last[k]], name, series.value[k], should,
            wanted[k])
        good = np.flatnonzero(settled & ~wrong & (wanted != 0.0))
        if len(good):
            words += '; with {} it was right'.format(device.place(device.value[last[good[0]]]))
        words += own_variable(inside, series)
    is_weak = (series.value * wanted > 0.0) & (np.abs(series.value) < 1.02 * abs(factor))
    return Broken(words, float(series.time[k]), name, bool(is_weak[wrong].all()))


def no_zero(commands: Any, begin: float, words: str) -> Optional[Broken]:
    """Does a zero follow within ANSWERED after `begin`, at which a driven robot should stop?"""
    speeds = np.abs(commands.linear) + np.abs(commands.angular)
    before = int(np.searchsorted(commands.arrival, begin + SOON))
    soon = int(np.searchsorted(commands.arrival, begin + ANSWERED))
    is_driven = before and speeds[before - 1] and begin - commands.arrival[before - 1] < RECENT
    if not is_driven or soon > before and not speeds[soon - 1]:
        return None
    return Broken('no zero velocity followed {}: {}'.format(
        words, 'no command came' if soon == before else
        '{:.1f} s later the command was {:.2f} m/s and {:.2f} rad/s'.format(
            ANSWERED, commands.linear[soon - 1], commands.angular[soon - 1])), begin)


def silent(commands: Any, device: Device, asks: Callable[[np.ndarray], Any],
           is_off: Callable[[float, float], Any]) -> Optional[Broken]:
    """Does a command come while an input is held? ``asks(row)``: for a movement;
    ``is_off(begin, end)``: none is to come."""
    for begin, end, row in device.held():
        if asks(row) and not is_off(begin, end) and not (
                (commands.arrival > begin) & (commands.arrival < end)).any():
            return Broken('with {} nothing came on cmd_vel for {:.1f} s'.format(
                device.place(row), end - begin), begin)
    return None


def link_of(laws: Callable[[Inside], List[Optional[Broken]]], weak: bool) -> Look:
    """The link that is broken by the first of the laws that is weak, or that is not."""
    return lambda inside: next((each for each in inside.known(laws)
                                if each is not None and each.is_weak == weak), None)
