"""The variables of a node over a run, by their names; see probe/sitecustomize.py.

In this room a `run` is a RunData (:mod:`tb3_labs.report.run_data`). All times are arrivals at the
recorder [s].
"""
import math
from collections import Counter
from dataclasses import dataclass
from typing import Any, Dict, List, Optional, Tuple

import numpy as np

TRUTH_VALUES = {'True': 1.0, 'False': 0.0}


@dataclass(frozen=True)
class Series:
    """The values of one variable. `value` is NaN if the text is not a number; True is 1."""

    name: str
    time: np.ndarray
    text: np.ndarray
    value: np.ndarray

    def _index_at(self, time: float) -> int:
        return max(0, int(np.searchsorted(self.time, time, 'right')) - 1)

    def at(self, time: float) -> float:
        """Returns the last value that was read until this time, else the first value."""
        return float(self.value[self._index_at(time)])

    def text_at(self, time: float) -> str:
        """Returns the text of this value."""
        return str(self.text[self._index_at(time)])

    def take(self, index: Any) -> 'Series':
        """Returns the part at a numpy index."""
        return Series(self.name, self.time[index], self.text[index], self.value[index])

    def between(self, begin: float, end: float) -> 'Series':
        """Returns the part in [begin, end)."""
        return self.take(slice(*np.searchsorted(self.time, (begin, end))))

    @property
    def changes(self) -> np.ndarray:
        """The times of the readings whose text differs from the reading before."""
        return self.time[1:][self.text[1:] != self.text[:-1]]


def to_number(text: str) -> float:
    """Returns the number in a variable's text; NaN if the text is not a number."""
    try:
        return TRUTH_VALUES[text] if text in TRUTH_VALUES else float(text)
    except ValueError:
        return math.nan


def shortened_value(text: str) -> str:
    """Returns a variable's text with few digits."""
    value = to_number(text)
    return text[:40] if np.isnan(value) else f'{value:.4g}'


def variables_by_node(rows: Any) -> Dict[str, Dict[str, Series]]:
    """Returns {node: {name: Series}} of the `variables` of a run, in the order of arrival."""
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
    """Returns {name: Series} of a node, by default of the node with the most values."""
    rows = run.variables
    counts = Counter(rows.node.tolist())
    most: str = max(sorted(counts), key=lambda each: counts[each], default='')
    chosen = node or most
    is_own = np.array([each == chosen for each in rows.node], dtype=bool)
    return variables_by_node(rows.take(is_own)).get(chosen, {})


def bare_name(name: str) -> str:
    """Returns a variable's own name in small letters: `curr_yaw` of `Controller._curr_yaw`."""
    return name.rpartition('.')[2].strip('_').lower()
