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
    printed = node_run.run.printed
    end_of_run = [*node_run.run.starts[1:], np.inf][0]
    texts = [str(text) for text in printed.text]
    time_of_letter = np.repeat(printed.arrival, [len(text) for text in texts])
    lines = list(HEADING_LINE.finditer(''.join(texts)))
    times = np.array([time_of_letter[line.end() - 1] for line in lines], dtype=float)
    numbers = np.array([line.group(1) for line in lines], dtype=object)
    return Series('the printed number', times, numbers, numbers.astype(float)).take(
        times < end_of_run)


def wrong_heading(node_run: NodeRun) -> Iterator[BrokenLink]:
    """Yields the printed number if it does not follow the heading from 0 to 360."""
    series = printed_headings(node_run)
    quantities = node_run.imu_quantities
    correct = quantities[0]
    if len(series.time) < 3 or not len(correct.time):
        return
    found = matching_quantities(series, quantities)
    followed = found[0] if found else None
    if followed is None and not is_constant(series):
        followed = heading_from_another_zero(series, correct, 1.0)
        if followed is None:
            followed = late_quantity(series, quantities)
    if followed is None:
        _, broken = followed_heading(series, quantities)
        if broken is not None:
            yield broken
    elif followed is not correct:
        yield wrong_value(series, expected('follows ' + followed.name, correct.name), correct)


def late_quantity(series: Series, quantities: List[Quantity]) -> Optional[Quantity]:
    """Returns the first heading that a variable follows late, or None."""
    for quantity in quantities:
        if not 0.0 < abs(quantity.per_degree) <= 1.0:
            continue
        delay = longest_delay(series, quantity)
        if delay < np.inf:
            return quantity._replace(name=f'{quantity.name}, up to {delay:.1f} s late')
    return None
