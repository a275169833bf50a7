"""Shared by the tests of the network: links, messages at known moments, and delayed messages."""
import functools
import math
from itertools import groupby
from operator import itemgetter

from tb3_labs.simulation.network import Link, LinkSettings

SPARSE = [float(k) for k in range(20000)]           # nothing waits for what was before it [s]
DENSE = [k / 1000.0 for k in range(600000)]         # ten minutes [s]
STALLING = LinkSettings(stalls_per_min=20.0, longest_stall=0.3)


def link_of(link_settings, direction='sensors', seed=1):
    link = Link(direction, seed)
    link.configure(link_settings, 0.0)
    return link


def carry(link, moments, until=math.inf):
    """The messages sent at `moments` that have arrived by `until`: [(arrival, number)]."""
    link.send(range(len(moments)), moments)
    return link.take(until)


@functools.lru_cache(maxsize=1)
def stalling_arrivals():
    """What becomes of ten minutes of messages on a link that stalls, for the tests that look at it."""
    return carry(link_of(STALLING), DENSE)


def stalls_of(arrivals, moments):
    """The delayed messages, stall by stall: [(end, moments of sending)]. Only without delay."""
    held = [(arrival, moments[number]) for arrival, number in arrivals
            if arrival != moments[number]]
    return [(end, [moment for _, moment in group])
            for end, group in groupby(held, itemgetter(0))]
