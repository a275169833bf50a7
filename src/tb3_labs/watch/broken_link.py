"""The first broken link of the chain sensor -> belief -> goal -> error -> command -> stop.

A lab has its links in a table, in their order. A link looks at a node's own variables, and at what
the node heard and commanded. It compares each with what the handout asks for by the node's *own*
numbers before it: what follows from one mistake is not told as another.
"""
from functools import cached_property, lru_cache
from typing import (
    Any, Callable, List, Mapping, NamedTuple, Optional, Sequence, Tuple)

import numpy as np

from tb3_labs.watch.quantities import Quantity, headings, matching_quantities, pause
from tb3_labs.watch.variables import Series, find, variables_of


#: A belief that changes less often is late [s].
LONGEST_UPDATE_GAP = 0.3
#: A node whose variables were not read for longer than this may have ended [s].
LONGEST_READING_GAP = 0.4
#: A longer pause between commands is a mistake [s].
LONGEST_COMMAND_GAP = 0.45
#: A heading that is off by less than this many times what is the same is still the heading.
COARSE_FACTOR = 30.0


class BrokenLink(NamedTuple):
    """A link that is broken: a sentence without its full stop, the moment [s], the variable that
    is wrong. `is_weak`: the handout's law is not kept, but a node may turn and drive well so."""

    words: str
    moment: float
    variable: str = ''
    is_weak: bool = False


class NodeRun:
    """A run, and the variables and commands of a node. `run`: a RunData; `node`: its name, by
    default that of the node with the most variables. If the recording does not know the senders,
    all commands are taken for those of the node."""

    def __init__(self, run: Any, node: Optional[str] = None) -> None:
        self.run, self.variables = run, variables_of(run, node)
        self.commands = run.commands
        # the marker of a trial has recorded the commands of its node, as their sender
        if node is not None and len(run.sender_index) and not len(run.events):
            newest = np.searchsorted(run.sender_index.arrival, run.commands.arrival, 'right') - 1
            # a node that sent nothing is not among the senders
            self.commands = run.commands.take(run.sender_index.value[newest.clip(0)] == (
                run.senders.index(node) if node in run.senders else -1.0))
        self.cached = lru_cache(maxsize=None)(lambda function: function(self))

    def find(self, name: str) -> Optional[Series]:
        """The first variable that has this name; None if there is none."""
        return find(self.variables, name)

    def flag(self, name: str) -> Optional[Series]:
        """The variable of this name, if all its values are True or False, or 1 or 0."""
        series = self.find(name)
        return series if series is not None and set(series.value) <= {0.0, 1.0} else None

    @cached_property
    def heading(self) -> Quantity:
        """The right heading, by the IMU: the first of `imu`, without the time that all take."""
        return next(headings(self.run.imu.arrival, quaternion_of(self.run.imu)))

    @cached_property
    def imu(self) -> List[Quantity]:
        """The quantities that a node may take for the heading, by the IMU; the first is right."""
        return list(headings(self.run.imu.arrival, quaternion_of(self.run.imu)))

    @cached_property
    def odometry(self) -> List[Quantity]:
        """The quantities that a node may take for the heading, by the odometry."""
        return list(headings(self.run.odometry.arrival, quaternion_of(self.run.odometry),
                             ' of the odometry'))

    @cached_property
    def readings(self) -> np.ndarray:
        """The times at which any variable was read [s]."""
        return np.unique(np.concatenate([np.empty(0)] + [
            series.time for series in self.variables.values()]))

    def runs_at(self, time: float) -> bool:
        """Does the node run, by a reading that is not older than LONGEST_READING_GAP?"""
        read = self.readings[:int(np.searchsorted(self.readings, time))]
        return bool((time - read[-1:] <= LONGEST_READING_GAP).any())

    def end_after(self, time: float) -> float:
        """The last reading of the node that runs at this time; inf if there is none."""
        read = self.readings[int(np.searchsorted(self.readings, time)):]
        return float(read[np.diff(read, append=np.inf) > LONGEST_READING_GAP][0]) if len(
            read) else np.inf

    def runs_from(self, begin: float, end: float) -> bool:
        """Does the node run all this time? Without variables it is not known: True."""
        return not len(self.readings) or self.runs_at(begin) and self.end_after(begin) >= end

    def constant(self, name: str, value: float) -> str:
        """Words on a constant of the node that differs from the handout's `value`, else ''."""
        series = self.find(name.lower())
        number = series.value[-1] if series is not None and len(series.value) else np.nan
        return '' if not np.isfinite(number) or number == value else \
            f'; its {name} is {number:g}, the handout has {value:g}'


#: The function that finds whether a link of a node is broken.
Check = Callable[[NodeRun], Optional[BrokenLink]]


def quaternion_of(samples: Any) -> Sequence[np.ndarray]:
    """w, x, y, z of samples; if only their yaw is known, of a level robot."""
    if hasattr(samples, 'w'):
        return samples.w, samples.x, samples.y, samples.z
    half, nothing = samples.yaw / 2.0, 0.0 * samples.yaw
    return np.cos(half), nothing, nothing, np.sin(half)


def sentence(found: BrokenLink, assigned: Mapping[str, Sequence[int]] = {}) -> str:
    """A broken link as a sentence. `assigned`: variable -> the lines of the node's file that assign
    it."""
    lines = assigned.get(found.variable, assigned.get(found.variable.rpartition('.')[2], ()))
    place = '' if not lines else ' ({} is assigned in line{} {})'.format(
        found.variable, 's' if len(lines) > 1 else '', ', '.join(map(str, lines[:5])))
    # a variable stays as it is written
    is_name = '_' in found.words.split()[0] or found.words.split()[0] == found.variable
    first = found.words[:1] if is_name else found.words[:1].upper()
    return f'{first}{found.words[1:]}{place}.'


# -- what several labs share

def is_heading(quantity: Quantity, right: Quantity) -> bool:
    """Is a quantity the heading, in any range, within a degree? Then a node can use it."""
    if quantity.per_degree <= 0.0:
        return False
    whole = 360.0 * quantity.per_degree
    apart = quantity.value - right.value / right.per_degree * quantity.per_degree
    return bool((np.abs(apart - whole * np.round(apart / whole)) < whole / 360.0).all())


def stays(series: Series) -> bool:
    """Does a variable never change, but for its first moments?"""
    return len(series.text) > 10 and len(set(series.text[len(series.text) // 20:])) == 1


def example(series: Series, right: Quantity) -> Tuple[float, str]:
    """(moment, words) of a value that is farthest from the right quantity."""
    samples = np.searchsorted(right.time, series.time).clip(1, len(right.time)) - 1
    apart = np.abs(series.value - right.value[samples])
    apart[~np.isfinite(apart)] = -1.0
    worst = int(np.argmax(apart))
    return float(series.time[worst]), 'it was {:.4g} when {} was {:.4g}'.format(
        series.value[worst], right.words.partition(',')[0], right.value[samples[worst]])


def belief(series: Series,
           quantities: List[Quantity]) -> Tuple[Optional[Quantity], Optional[BrokenLink]]:
    """(the quantity that a variable follows, None; or None, the BrokenLink if it is not the first
    of `quantities`, in any range)."""
    right, name = quantities[0], series.name
    found = matching_quantities(series, quantities)
    usable = [each for each in found if is_heading(each, right)] or matching_quantities(
        # the samples of a busy machine come late, or not at all
        series, [each._replace(scale=COARSE_FACTOR * each.scale) for each in quantities
                 if is_heading(each, right)] if not found else [])
    if usable:
        return usable[0], None
    expectation = 'it should be ' + right.words
    moment, numbers = example(series, right)
    if stays(series) and not found:
        return None, BrokenLink(f'{name} stays at {series.text[-1][:40]}; {expectation}',
                                moment, name)
    if found:
        also = [each.words for each in found[1:2] if not np.allclose(
            each.value, found[0].value, atol=1e-3 * each.scale)]
        return None, BrokenLink('{} follows {}; {}: {}'.format(
            name, ', or '.join([found[0].words] + also), expectation, numbers), moment, name)
    rare = pause(series, right)
    return None, BrokenLink('{} does not follow {}{}: {}'.format(
        name, right.words, ', but changes only every {:.1f} s while that changes'.format(
            rare) if rare > LONGEST_UPDATE_GAP else '', numbers), moment, name)


def slow_rate_text(time: np.ndarray) -> str:
    """Words on commands at these times if they come too seldom, else ''."""
    pause = float(np.median(np.diff(time)))
    return '' if pause <= LONGEST_COMMAND_GAP else \
        f'commands came every {pause:.1f} s; the handout has ten a second'


#: The fields of a command that no wheel follows: its name in Twists, and in the message.
UNUSED = (('sideways', 'linear.y'), ('upward', 'linear.z'), ('rolling', 'angular.x'),
          ('pitching', 'angular.y'))


def wrong_field(sent: Any, fields: Sequence[Tuple[str, str]] = UNUSED) -> str:
    """A clause on the first of these fields in which the commands have a speed; '' if none has."""
    for field, words in fields:
        speeds = getattr(sent, field, np.empty(0))
        if speeds.any():
            return f'{words} was {speeds[np.argmax(np.abs(speeds))]:.2g}'
    return ''


def other_field_text(node_run: NodeRun) -> str:
    """Words on a field of the commands in which there is a speed that was not asked for."""
    found = wrong_field(node_run.commands, (*UNUSED, ('linear', 'linear.x')))
    return found and '; ' + found
