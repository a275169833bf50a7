"""A broken link of the chain sensor -> belief -> goal -> error -> command -> stop.

A link looks at a node's own variables, and at the messages that the node received and sent. It
compares each with the number that the handout asks for by the node's *own* numbers before it. So a
consequence of one mistake is not reported as another mistake.
"""
from functools import cached_property, lru_cache
from typing import Any, Callable, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from tb3_labs.watch.quantities import Quantity, headings, matching_quantities, median_pause
from tb3_labs.watch.variables import Series, bare_name, variables_of

#: A variable that changes less often is late [s].
LONGEST_UPDATE_GAP = 0.3
#: A node whose variables were not read for longer than this may have ended [s].
LONGEST_READING_GAP = 0.4
#: A longer pause between commands is a mistake [s].
LONGEST_COMMAND_GAP = 0.45
#: If a variable follows nothing, it is compared with the heading at this times the tolerance.
COARSE_FACTOR = 30.0
#: A variable of more than ENOUGH values is constant if it does not change after 1/20 of them.
ENOUGH = 10


class BrokenLink(NamedTuple):
    """A link that is broken: a sentence without its full stop, the moment [s], the wrong variable.
    It `is_weak` if the node does not keep the handout's law, but may turn and drive well."""

    words: str
    moment: float
    variable: str = ''
    is_weak: bool = False


#: A function that yields the BrokenLinks of one link, of which the first is reported. Its docstring
#: says what is broken.
Check = Callable[['NodeRun'], Iterator[BrokenLink]]


class NodeRun:
    """A run, and the variables and commands of one of its nodes."""

    def __init__(self, run: Any, node: Optional[str] = None) -> None:
        """`run`: a RunData; `node`: its name, by default that of the node with the most variables.
        If the recording does not have the senders of commands, all commands are the node's."""
        self.run, self.variables = run, variables_of(run, node)
        self.commands = run.commands
        # in the recording of a trial all commands are the node's
        if node is not None and len(run.sender_index) and not len(run.events):
            latest = np.searchsorted(run.sender_index.arrival, run.commands.arrival, 'right') - 1
            own = run.senders.index(node) if node in run.senders else -1.0
            self.commands = run.commands.take(run.sender_index.value[latest.clip(0)] == own)
        #: ``cached(function)`` is ``function(self)``, which is computed once.
        self.cached = lru_cache(maxsize=None)(lambda function: function(self))

    def find(self, name: str) -> Optional[Series]:
        """Returns the first variable that has this name, in any object; None if there is none."""
        return next((series for each, series in self.variables.items()
                     if bare_name(each) == name), None)

    def flag(self, name: str) -> Optional[Series]:
        """Returns the variable of this name if all its values are True or False, or 1 or 0."""
        series = self.find(name)
        return series if series is not None and set(series.value) <= {0.0, 1.0} else None

    @cached_property
    def heading(self) -> Quantity:
        """The right heading by the IMU. It takes less time than all of `imu_quantities`."""
        return next(headings(self.run.imu.arrival, quaternion_of(self.run.imu)))

    @cached_property
    def imu_quantities(self) -> List[Quantity]:
        """The quantities of the IMU that a node may take for the heading; the first is right."""
        return list(headings(self.run.imu.arrival, quaternion_of(self.run.imu)))

    @cached_property
    def odometry_quantities(self) -> List[Quantity]:
        """The quantities of the odometry that a node may take for the heading."""
        return list(headings(self.run.odometry.arrival, quaternion_of(self.run.odometry),
                             ' of the odometry'))

    @cached_property
    def reading_times(self) -> np.ndarray:
        """The times at which any variable was read [s]."""
        return np.unique(np.concatenate([np.empty(0)] + [
            series.time for series in self.variables.values()]))

    def runs_at(self, time: float) -> bool:
        """Was a variable read in the LONGEST_READING_GAP before this time?"""
        before = self.reading_times[self.reading_times < time]
        return bool(len(before) and time - before[-1] <= LONGEST_READING_GAP)

    def end_after(self, time: float) -> float:
        """Returns the last reading before the first gap after this time; inf if there is none."""
        later = self.reading_times[self.reading_times >= time]
        is_last = np.diff(later, append=np.inf) > LONGEST_READING_GAP
        return float(later[is_last][0]) if len(later) else np.inf

    def may_run(self, begin: float, end: float) -> bool:
        """Does the node run all this time? True, too, if none of its variables was read."""
        return not len(self.reading_times) or self.runs_at(begin) and self.end_after(begin) >= end

    def constant_text(self, name: str, value: float) -> str:
        """Returns a clause on a constant of the node that is not the handout's `value`, else ''."""
        series = self.find(name.lower())
        own = series.value[-1] if series is not None else np.nan
        return '' if not np.isfinite(own) or own == value else \
            f'; its {name} is {own:g}, the handout has {value:g}'


def quaternion_of(samples: Any) -> Sequence[np.ndarray]:
    """Returns w, x, y, z of samples; of a level robot if the samples have a yaw alone."""
    if hasattr(samples, 'w'):
        return samples.w, samples.x, samples.y, samples.z
    half, zeros = samples.yaw / 2.0, 0.0 * samples.yaw
    return np.cos(half), zeros, zeros, np.sin(half)


def sentence(broken: BrokenLink, assigned: Mapping[str, Sequence[int]] = {}) -> str:
    """Returns the sentence. `assigned`: variable -> the lines of the node's file that assign it."""
    name, words = broken.variable, broken.words
    lines = assigned.get(name, assigned.get(name.rpartition('.')[2], ()))
    place = '' if not lines else ' ({} is assigned in line{} {})'.format(
        name, 's' if len(lines) > 1 else '', ', '.join(map(str, lines[:5])))
    first_word = words.split()[0]
    if '_' not in first_word and first_word != name:        # a variable stays as it is written
        words = words[:1].upper() + words[1:]
    return f'{words}{place}.'


# -- functions that several labs share

def is_usable_heading(quantity: Quantity, right: Quantity) -> bool:
    """Is a quantity the heading in any range, within a degree? Then a node can use it."""
    if quantity.per_degree <= 0.0:
        return False
    whole_turn = 360.0 * quantity.per_degree
    apart = quantity.value - right.value / right.per_degree * quantity.per_degree
    return bool((np.abs(apart - whole_turn * np.round(apart / whole_turn))
                 < quantity.per_degree).all())


def is_constant(series: Series) -> bool:
    """Does a variable never change after its first moments?"""
    return len(series.text) > ENOUGH and len(set(series.text[len(series.text) // 20:])) == 1


def farthest(series: Series, should: np.ndarray) -> int:
    """Returns the index of the value that differs most from the value that it should have."""
    apart = np.abs(series.value - should)
    return int(np.argmax(np.where(np.isfinite(apart), apart, -1.0)))


def wrong_value(series: Series, behaviour: str, right: Quantity) -> BrokenLink:
    """Returns the BrokenLink of a variable with this `behaviour` that should follow the right
    quantity. Its numbers are those of the largest difference."""
    should = right.at(series.time)
    worst = farthest(series, should)
    return BrokenLink('{} {}: it was {:.4g} when {} was {:.4g}'.format(
        series.name, behaviour, series.value[worst], right.words.partition(',')[0], should[worst]),
        series.time[worst], series.name)


def followed_heading(series: Series, quantities: List[Quantity]
                     ) -> Tuple[Optional[Quantity], Optional[BrokenLink]]:
    """Returns (the usable heading that a variable follows, None), or (None, the BrokenLink). The
    first of the `quantities` is right."""
    right = quantities[0]
    found = matching_quantities(series, quantities)
    usable = [each for each in found or quantities if is_usable_heading(each, right)]
    if not found:       # the samples of a busy machine come late, or not at all
        usable = matching_quantities(
            series, [each._replace(scale=COARSE_FACTOR * each.scale) for each in usable])
    if usable:
        return usable[0], None
    if is_constant(series) and not found:
        words = expected(f'{series.name} stays at {series.text[-1][:40]}', right.words)
        return None, wrong_value(series, '', right)._replace(words=words)
    if found:
        also = [each.words for each in found[1:2] if not np.allclose(
            each.value, found[0].value, atol=1e-3 * each.scale)]
        words = 'follows ' + ', or '.join([found[0].words] + also)
        return None, wrong_value(series, expected(words, right.words), right)
    pause = median_pause(series, right)
    rarely = f', but changes only every {pause:.1f} s while that changes'
    return None, wrong_value(series, 'does not follow {}{}'.format(
        right.words, rarely if pause > LONGEST_UPDATE_GAP else ''), right)


def expected(observation: str, right: Any) -> str:
    """Returns the clause on an observation and on the right value in its place."""
    return f'{observation}; it should be {right}'


def slow_commands(times: np.ndarray, begin: float) -> Iterator[BrokenLink]:
    """Yields commands at these times, from `begin` on, that come too seldom."""
    pause = np.median(np.diff(times))
    if pause > LONGEST_COMMAND_GAP:
        yield BrokenLink(f'commands came every {pause:.1f} s; the handout has ten a second', begin)


#: The fields of a command that no wheel follows: the name in Twists, and in the message.
UNUSED_FIELDS = (('sideways', 'linear.y'), ('upward', 'linear.z'), ('rolling', 'angular.x'),
                 ('pitching', 'angular.y'))


def wrong_field(sent: Any, fields: Sequence[Tuple[str, str]] = UNUSED_FIELDS) -> str:
    """Returns a clause on the first of these fields in which the commands have a speed, else ''."""
    for field, words in fields:
        speeds = getattr(sent, field, np.empty(0))
        if speeds.any():
            return f'{words} was {speeds[np.argmax(np.abs(speeds))]:.2g}'
    return ''


def other_field_text(node_run: NodeRun) -> str:
    """Returns a clause on a field of the commands in which no speed was asked for, else ''."""
    clause = wrong_field(node_run.commands, (*UNUSED_FIELDS, ('linear', 'linear.x')))
    return clause and '; ' + clause
