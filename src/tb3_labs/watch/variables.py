"""Finds the quantities that the variables of a node follow in a recorded run.

probe/sitecustomize.py reads the variables. A quantity is a number that a formula gives for each
message of a sensor. A variable follows a quantity if each value of the variable is the formula's
number for a recent message. Times are arrivals at the recorder.
"""
import math
from dataclasses import dataclass
from typing import Any, Dict, Iterable, List, NamedTuple, Tuple

import numpy as np

from tb3_labs.geometry.arrays import index_at_or_before, index_before

#: Two numbers are equal if they differ by at most this share of the quantity's scale.
TOLERANCE_SHARE = 3e-4
#: A variable follows a quantity if at least this share of its values comes from recent samples.
MIN_FOLLOWING_SHARE = 0.98
MAX_LATENESS = 60.0     # a variable may follow a quantity at most this late [s]
#: A variable follows late if at least this share of its values is at most MAX_LATENESS late.
DELAYED_SHARE = 0.9
#: A sample is recent until this time [s] after the next sample arrives.
RECENT_TIME = 0.5
#: A sample may reach the node up to this time [s] earlier than the recorder.
MAX_ARRIVAL_LEAD = 0.03
MAX_COMPARED_VALUES = 400
MIN_STEP = 1e-3         # [s], the time between samples that limits the number of compared samples
EXTRA_SAMPLES = 2       # the newest sample is not yet replaced, and the count is rounded down
ROUNDING_ERROR = 1e-9
BOOLEAN_VALUES = {'True': 1.0, 'False': 0.0}


@dataclass(frozen=True)
class Series:
    """The readings of one variable, each with a time, a text and a number `value`. The `value` is 1
    for the text True, 0 for False, and NaN for any other text that is not a number."""

    name: str
    time: np.ndarray
    text: np.ndarray
    value: np.ndarray

    def at(self, time: Any) -> Any:
        """Returns the last number read up to each time, or the first number if all are later."""
        return self.value[index_at_or_before(self.time, time).clip(0)]

    def text_at(self, time: float) -> str:
        """Returns the last text read up to this time, or the first text if all are later."""
        return str(self.text[max(0, index_at_or_before(self.time, time))])

    def take(self, index: Any) -> 'Series':
        return Series(self.name, self.time[index], self.text[index], self.value[index])

    def between(self, begin: float, end: float) -> 'Series':
        """Returns the readings in [begin, end)."""
        return self.take(slice(*np.searchsorted(self.time, (begin, end))))

    @property
    def changes(self) -> np.ndarray:
        """The times of the readings whose text differs from the text of the previous reading."""
        return self.time[1:][self.text[1:] != self.text[:-1]]


def to_number(text: str) -> float:
    """Returns a variable's text as a number, or NaN."""
    try:
        return BOOLEAN_VALUES[text] if text in BOOLEAN_VALUES else float(text)
    except ValueError:
        return math.nan


def shortened_value(text: str) -> str:
    """Returns a variable's text with at most 40 characters. A number is rounded to four digits."""
    value = to_number(text)
    return text[:40] if np.isnan(value) else f'{value:.4g}'


def variables_by_node(rows: Any) -> Dict[str, Dict[str, Series]]:
    """Returns {node: {name: Series}} for the field `variables` of a RunData."""
    numbers = {text: to_number(text) for text in set(rows.value.tolist())}
    indices: Dict[Tuple[str, str], List[int]] = {}
    for index, key in enumerate(zip(rows.node.tolist(), rows.name.tolist())):
        indices.setdefault(key, []).append(index)
    nodes: Dict[str, Dict[str, Series]] = {}
    for (node, name), row_indices in indices.items():
        texts = rows.value[row_indices]
        nodes.setdefault(node, {})[name] = Series(
            name, rows.arrival[row_indices], texts, np.array([numbers[text] for text in texts]))
    return nodes


def bare_name(name: str) -> str:
    """Returns a variable's own name in small letters: `curr_yaw` for `Controller._curr_yaw`."""
    return name.rpartition('.')[2].strip('_').lower()


class Quantity(NamedTuple):
    """A number for each sample of a sensor. `name` names the number and its unit. The range of the
    number is about `scale`. If the quantity is a heading, a turn of one degree to the left adds
    `per_degree` to the number. If it is not a heading, `per_degree` is 0."""

    name: str
    time: np.ndarray
    value: np.ndarray
    scale: float
    per_degree: float = 0.0

    def at(self, time: Any) -> Any:
        """Returns the last number before each time, or the first number if none is before."""
        return self.value[index_before(self.time, time).clip(0)]


def sample_ages(series: Series, quantity: Quantity, max_age: float = RECENT_TIME) -> np.ndarray:
    """Returns, for each value of a variable, the age [s] of the newest sample that equals the
    value. The age of a sample is the time since the next sample replaced it, and 0 before. If no
    sample with an age up to `max_age` equals the value, the age is inf."""
    times, readings = quantity.time, series.time
    if not len(times) or not len(readings):
        return np.full(len(readings), np.inf)
    step = float(np.median(np.diff(times))) if len(times) > 1 else 1.0
    recent_count = int((max_age + MAX_ARRIVAL_LEAD) / max(step, MIN_STEP))
    count = min(len(times), recent_count + EXTRA_SAMPLES)
    # in the arrays below, a row is a reading, and a column is a sample, with the newest first
    newest = index_before(times, readings + MAX_ARRIVAL_LEAD)
    indices_before = newest[:, None] - np.arange(count)     # negative before the first sample
    indices = indices_before.clip(0)
    replaced_at = np.append(times[1:], np.inf)    # a sample is replaced by the next sample
    age = (readings[:, None] - replaced_at[indices]).clip(0.0)
    distance = np.abs(series.value[:, None] - quantity.value[indices])
    is_recent = (indices_before >= 0) & (age <= max_age)
    is_equal = distance <= TOLERANCE_SHARE * quantity.scale
    return np.where(is_recent & is_equal, age, np.inf).min(axis=1)


def subsampled(series: Series) -> Series:
    """Returns about MAX_COMPARED_VALUES of the finite numbers in `series`, at equal intervals."""
    indices = np.flatnonzero(np.isfinite(series.value))
    step = max(1, len(indices) // MAX_COMPARED_VALUES)
    return series.take(indices[::step])


def matching_quantities(series: Series, quantities: Iterable[Quantity],
                        share: float = MIN_FOLLOWING_SHARE) -> List[Quantity]:
    """Returns the quantities that a variable follows, in the given order. If a variable follows
    several quantities, the recording does not show which of them the node uses."""
    # the first value is left out, because the node may set it before the first message comes
    changes = np.flatnonzero(series.text != series.text[:1])
    first_change = changes[0] if len(changes) else 0
    values = subsampled(series.take(slice(first_change, None)))
    if not len(values.time):
        return []
    return [quantity for quantity in quantities
            if np.isfinite(sample_ages(values, quantity)).mean() >= share - ROUNDING_ERROR]


def longest_delay(series: Series, quantity: Quantity) -> float:
    """Returns the delay [s] that only a few of the values exceed, or inf if it is too long."""
    ages = np.sort(sample_ages(subsampled(series), quantity, MAX_LATENESS))
    if not len(ages):
        return math.inf
    return float(ages[int(DELAYED_SHARE * (len(ages) - 1))])
