"""Finds the first mistake of a node in its recorded numbers.

A node computes its numbers in this order: heading or pose, goal, error, command, stop. A check
compares one of these numbers with the correct number. The check computes the correct number by the
handout's formula from the node's *own* earlier numbers. If an earlier number is wrong, the later
numbers that depend on it are therefore not reported as further mistakes.
"""
from functools import cached_property
from typing import (
    Any, Callable, Iterable, Iterator, Mapping, NamedTuple, Optional, Sequence, Tuple)

import numpy as np

from tb3_labs.watch.variables import Series, bare_name, variables_by_node

#: If the variables of a node were not read for this time [s], the node may have ended.
MAX_READING_GAP = 0.4
MAX_COMMAND_PAUSE = 0.45        # [s]
SPEED_TOLERANCE = 0.01          # [m/s, rad/s]
MIN_READINGS = 11
UNJUDGED_SHARE = 0.05           # a node may set a variable after the variable's first readings


class SheetStep(NamedTuple):
    """A numbered `step` in a section of a lab sheet, or the whole section if `step` is 0."""

    sheet: str
    heading: str
    step: int = 0

    def at_step(self, step: int) -> 'SheetStep':
        return SheetStep(self.sheet, self.heading, step)

    def __str__(self) -> str:
        step_clause = f', step {self.step}' if self.step else ''
        return f'doc/{self.sheet}, "{self.heading}"{step_clause}'


class Mistake(NamedTuple):
    """A mistake of a node, which is visible at the time `moment` [s]. `message` has no period at
    its end. `question` and `sheet_step` are those of the check that has found the mistake."""

    message: str
    moment: float
    variable: str = ''
    question: str = ''
    sheet_step: Optional[SheetStep] = None

    def as_sentence(self, assigned: Mapping[str, Sequence[int]] = {}) -> str:
        """Returns the message as a sentence. `assigned` is {variable: lines that assign it}."""
        message = self.message
        attribute = self.variable.rpartition('.')[2]
        lines = assigned.get(self.variable) or assigned.get(attribute, ())
        lines_clause = ''
        if lines:
            word = 'line' if len(lines) == 1 else 'lines'
            numbers = ', '.join(map(str, lines[:5]))
            lines_clause = f' ({self.variable} is assigned in {word} {numbers})'
        first_word = message.split()[0]
        if '_' not in first_word and first_word != self.variable:
            message = message[:1].upper() + message[1:]     # a variable's name keeps its case
        return f'{message}{lines_clause}.'


#: A function that yields the Mistakes of a node. Only the first Mistake is reported.
MistakeFinder = Callable[['NodeRun'], Iterator[Mistake]]


class NodeRun:
    """The variables and the commands of one node of a recorded run."""

    def __init__(self, recording: Any, node: Optional[str] = None) -> None:
        """`recording` is a RunData. `node` is the node's name. By default, the variables are those
        of the node with the most readings, and the commands are those of all senders. If `node` is
        given, a command of an unknown sender counts as a command of this node."""
        self.recording = recording
        node_of_reading = recording.variables.node
        variables_of = variables_by_node(recording.variables)
        busiest = max(variables_of, key=lambda name: np.sum(node_of_reading == name), default='')
        self.variables = variables_of.get(busiest if node is None else node, {})
        self.commands = recording.commands
        if node is not None:
            self.commands = recording.commands.take(np.isin(recording.commands.sender, ['', node]))

    def variable(self, name: str) -> Optional[Series]:
        """Returns the first variable with this `bare_name`, or None."""
        return next((series for full_name, series in self.variables.items()
                     if bare_name(full_name) == name), None)

    def boolean_variable(self, name: str) -> Optional[Series]:
        """Returns the variable, or None if it has a value other than True, False, 1 and 0."""
        series = self.variable(name)
        if series is None or not set(series.value) <= {0.0, 1.0}:
            return None
        return series

    @cached_property
    def reading_times(self) -> np.ndarray:
        """The times [s] at which any variable was read."""
        times = [series.time for series in self.variables.values()]
        return np.unique(np.concatenate([np.empty(0), *times]))

    def runs_at(self, time: float) -> bool:
        """Returns True if a variable was read at most MAX_READING_GAP before this time."""
        earlier_times = self.reading_times[self.reading_times < time]
        return bool((time - earlier_times <= MAX_READING_GAP).any())

    def last_reading_before_gap(self, time: float) -> float:
        """Returns the time of the last reading before the next gap, or inf without a reading."""
        later_times = self.reading_times[self.reading_times >= time]
        is_before_gap = np.diff(later_times, append=np.inf) > MAX_READING_GAP
        return float(min(later_times[is_before_gap], default=np.inf))


class Check(NamedTuple):
    """A check of one number of a node. A student can answer the `question` by looking at the node.
    The check is done in these `parts` of the lab, named as in marking/labs. If `is_remarked`, a
    student is told about a mistake even if the mistake costs no points."""

    question: str
    find_mistakes: MistakeFinder
    sheet_step: SheetStep
    parts: Tuple[str, ...]
    is_remarked: bool = False


def find_first_mistake(node_run: NodeRun, checks: Iterable[Check],
                       parts: Optional[Iterable[str]] = None) -> Optional[Mistake]:
    """Returns the first mistake, or None. If `parts` are given, only their checks are done."""
    for check in checks:
        if parts is None or set(check.parts) & set(parts):
            mistake = next(check.find_mistakes(node_run), None)
            if mistake is not None:
                return mistake._replace(question=check.question, sheet_step=check.sheet_step)
    return None


def is_constant(series: Series) -> bool:
    """Returns True if all readings of a variable, after the first few readings, are equal."""
    count = len(series.text)
    first_judged = int(UNJUDGED_SHARE * count)
    return count >= MIN_READINGS and len(set(series.text[first_judged:])) == 1


def worst_index(series: Series, expected: np.ndarray) -> int:
    """Returns the index at which a variable differs most from `expected`, its correct values."""
    error = np.abs(series.value - expected)
    return int(np.argmax(np.where(np.isfinite(error), error, -1.0)))


def find_slow_commands(times: np.ndarray, begin: float) -> Iterator[Mistake]:
    """Yields a Mistake, at the time `begin`, if the `times` of commands are too far apart."""
    pause = np.median(np.diff(times))
    if pause > MAX_COMMAND_PAUSE:
        yield Mistake(f'commands came every {pause:.1f} s; the handout has ten a second', begin)


#: (name in Commands, name in the message) of each command field that moves no wheel.
UNUSED_FIELDS = (('sideways', 'linear.y'), ('upward', 'linear.z'), ('rolling', 'angular.x'),
                 ('pitching', 'angular.y'))


def nonzero_field_text(commands: Any, fields: Sequence[Tuple[str, str]] = UNUSED_FIELDS) -> str:
    """Returns a clause on the first of these `fields` that is not always 0, or ''."""
    for field, field_text in fields:
        speeds = getattr(commands, field)
        if speeds.any():
            return f'{field_text} was {speeds[np.argmax(np.abs(speeds))]:.2g}'
    return ''
