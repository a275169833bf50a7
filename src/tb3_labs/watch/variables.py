"""The variables of a node over a run, by their names. probe/sitecustomize.py reads them.

In this folder a `run` is a RunData (:mod:`tb3_labs.report.run_data`). All times are arrivals at the
recorder [s].
"""
import math
from collections import Counter
from dataclasses import dataclass
from typing import Any, Dict, List, Optional, Tuple

import numpy as np

from tb3_labs.geometry.arrays import last_until

TRUTH_VALUES = {'True': 1.0, 'False': 0.0}


@dataclass(frozen=True)
class Series:
    """The readings of one variable, each with a time, a text and a number `value`. The `value` is 1
    for the text True, 0 for False, and NaN for any other text that is not a number."""

    name: str
    time: np.ndarray
    text: np.ndarray
    value: np.ndarray

    def at(self, time: float) -> float:
        """Returns the number of the last reading up to this time, or of the first reading."""
        return float(self.value[max(0, last_until(self.time, time))])

    def text_at(self, time: float) -> str:
        """Returns the text of the last reading up to this time, or of the first reading."""
        return str(self.text[max(0, last_until(self.time, time))])

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
    """Returns the number that a variable's text shows, or NaN."""
    try:
        return TRUTH_VALUES[text] if text in TRUTH_VALUES else float(text)
    except ValueError:
        return math.nan


def shortened_value(text: str) -> str:
    """Returns a variable's text, shortened to 40 characters; a number is rounded to four digits."""
    value = to_number(text)
    return text[:40] if np.isnan(value) else f'{value:.4g}'


def variables_by_node(rows: Any) -> Dict[str, Dict[str, Series]]:
    """Returns {node: {name: Series}} of `rows`, the `variables` of a run."""
    numbers = {text: to_number(text) for text in set(rows.value.tolist())}
    indices: Dict[Tuple[str, str], List[int]] = {}
    for index, key in enumerate(zip(rows.node.tolist(), rows.name.tolist())):
        indices.setdefault(key, []).append(index)
    nodes: Dict[str, Dict[str, Series]] = {}
    for (node, name), part in indices.items():
        texts = rows.value[part]
        nodes.setdefault(node, {})[name] = Series(
            name, rows.arrival[part], texts, np.array([numbers[text] for text in texts]))
    return nodes


def variables_of(run: Any, node: Optional[str] = None) -> Dict[str, Series]:
    """Returns {name: Series} of `node`, by default of the node with the most readings."""
    rows = run.variables
    counts = Counter(rows.node.tolist())
    most: str = max(sorted(counts), key=lambda name: counts[name], default='')
    chosen = node or most
    is_own = np.array([name == chosen for name in rows.node], dtype=bool)
    return variables_by_node(rows.take(is_own)).get(chosen, {})


def bare_name(name: str) -> str:
    """Returns a variable's own name in small letters: `curr_yaw` of `Controller._curr_yaw`."""
    return name.rpartition('.')[2].strip('_').lower()
