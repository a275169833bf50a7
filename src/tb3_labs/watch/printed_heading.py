"""The link of the IMU exercise: the heading that the node prints follows the heading by the IMU."""
import re
from typing import Iterator, List, Optional

import numpy as np

from tb3_labs.handout import PRINTED_HEADING
from tb3_labs.watch.broken_link import (
    BrokenLink, NodeRun, expected, followed_heading, is_constant, wrong_value)
from tb3_labs.watch.quantities import (
    Quantity, heading_from_another_zero, longest_delay, matching_quantities)
from tb3_labs.watch.variables import Series

HEADING_LINE = re.compile(PRINTED_HEADING.format(r'(-?[\d.]*\d(?:e[-+]?\d+)?)'))


def printed_headings(node_run: NodeRun) -> Series:
    """Returns the headings that the node printed in its first run."""
    printed, end = node_run.run.printed, [*node_run.run.starts[1:], np.inf][0]
    texts = [str(text) for text in printed.text]
    time_of_letter = np.repeat(printed.arrival, [len(text) for text in texts])
    lines = [(time_of_letter[line.end() - 1], line.group(1))
             for line in HEADING_LINE.finditer(''.join(texts))]
    lines = [(time, number) for time, number in lines if time < end]
    numbers = np.array([number for _, number in lines], dtype=object)
    return Series('the printed number', np.array([time for time, _ in lines], dtype=float),
                  numbers, numbers.astype(float))


def wrong_heading(node_run: NodeRun) -> Iterator[BrokenLink]:
    """Yields a printed number that is not the heading from 0 to 360."""
    series, quantities = printed_headings(node_run), node_run.imu_quantities
    correct = quantities[0]
    if len(series.time) < 3 or not len(correct.time):
        return
    found = matching_quantities(series, quantities)
    followed = found[0] if found else None
    if followed is None and not is_constant(series):
        followed = heading_from_another_zero(series, correct, 1.0) or late_quantity(
            series, quantities)
    broken = followed_heading(series, quantities)[1] if followed is None else wrong_value(
        series, expected('follows ' + followed.name, correct.name), correct)
    if followed is not correct and broken is not None:
        yield broken


def late_quantity(series: Series, quantities: List[Quantity]) -> Optional[Quantity]:
    """Returns the first heading that a variable follows late, or None."""
    for each in quantities:
        delay = longest_delay(series, each) if 0.0 < abs(each.per_degree) <= 1.0 else np.inf
        if delay < np.inf:
            return each._replace(name=f'{each.name}, up to {delay:.1f} s late')
    return None
