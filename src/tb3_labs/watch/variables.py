"""The variables of a node over a run, by their names; see probe/sitecustomize.py.

`run` stands for a RunData (:mod:`tb3_labs.report.run_data`) in this room. All times are arrivals at
its recorder [s].
"""
import math
from dataclasses import dataclass
from typing import Any, Dict, List, Optional, Tuple

import numpy as np

WORDS = {'True': 1.0, 'False': 0.0}


@dataclass(frozen=True)
class Series:
    """One variable over time. `value` is NaN where its text is not a number; True is 1."""

    name: str
    time: np.ndarray
    text: np.ndarray
    value: np.ndarray

    def at(self, time: float) -> float:
        """The last value that was read until this time, else the first one."""
        return float(self.value[max(0, int(np.searchsorted(self.time, time, 'right')) - 1)])

    def text_at(self, time: float) -> str:
        """The last value that was read until this time, as a text."""
        return str(self.text[max(0, int(np.searchsorted(self.time, time, 'right')) - 1)])

    def take(self, index: Any) -> 'Series':
        """The part at a numpy index."""
        return Series(self.name, self.time[index], self.text[index], self.value[index])

    def between(self, begin: float, end: float) -> 'Series':
        """The part in [begin, end)."""
        return self.take(slice(*np.searchsorted(self.time, (begin, end))))

    @property
    def changes(self) -> np.ndarray:
        """The times at which the text had just changed."""
        return self.time[1:][self.text[1:] != self.text[:-1]]


def number(text: str) -> float:
    """The number in a variable's text; NaN if it is none."""
    try:
        return WORDS[text] if text in WORDS else float(text)
    except ValueError:
        return math.nan


def short(text: str) -> str:
    """A variable's text with few digits."""
    value = number(text)
    return text[:40] if np.isnan(value) else f'{value:.4g}'


def nodes_of(run: Any) -> Dict[str, Dict[str, Series]]:
    """Returns {node: {name: Series}} in the order of arrival. A recording is sorted only once: the
    marks and each figure of the page ask for its variables."""
    rows = run.variables
    if '_nodes' not in vars(rows):
        vars(rows)['_nodes'] = _sorted(rows)
    return vars(rows)['_nodes']


def _sorted(rows: Any) -> Dict[str, Dict[str, Series]]:
    numbers = {text: number(text) for text in set(rows.value.tolist())}
    places: Dict[Tuple[str, str], List[int]] = {}
    for place, key in enumerate(zip(rows.node.tolist(), rows.name.tolist())):
        places.setdefault(key, []).append(place)
    nodes: Dict[str, Dict[str, Series]] = {}
    for (node, name), part in places.items():
        texts = rows.value[part]
        nodes.setdefault(node, {})[name] = Series(
            name, rows.arrival[part], texts, np.array([numbers[text] for text in texts]))
    return nodes


def variables_of(run: Any, node: Optional[str] = None) -> Dict[str, Series]:
    """Returns {name: Series} of a node, by default of the node with the most values."""
    nodes = nodes_of(run)

    def number_of_values(each: str) -> int:
        return sum(len(series.time) for series in nodes[each].values())
    most = max(sorted(nodes), key=number_of_values, default='')
    return nodes.get(node or most, {})


def bare(name: str) -> str:
    """A variable's own name in small letters: `curr_yaw` of `Controller._curr_yaw`."""
    return name.rpartition('.')[2].strip('_').lower()


def find(variables: Dict[str, Series], wanted: str) -> Optional[Series]:
    """The first variable that has this name; None if there is none."""
    return next((series for name, series in variables.items() if bare(name) == wanted), None)
