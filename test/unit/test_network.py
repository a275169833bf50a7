"""The network of the simulated robot: the effects of its delays, jitter, stalls and cuts."""
import functools
import math
from dataclasses import replace
from itertools import groupby
from operator import itemgetter

import pytest

from tb3_labs.simulation.network import Interruptions, NetworkLink
from tb3_labs.simulation.simulator_config import SimulatorConfig

SPARSE = [float(k) for k in range(20000)]           # no message waits for an earlier one [s]
DENSE = [k / 1000.0 for k in range(600000)]         # ten minutes [s]
STALLING = SimulatorConfig(stalls_per_min=20.0, longest_stall=0.3)


def link_of(settings, direction='sensor', seed=1):
    link = NetworkLink(direction, seed)
    link.configure(settings, 0.0)
    return link


def carry(link, moments, until=math.inf):
    """The messages sent at `moments` that have arrived by `until`: [(arrival, number)]."""
    link.send(range(len(moments)), moments)
    return link.pop(until)


@functools.lru_cache(maxsize=1)
def stalling_arrivals():
    """The arrivals of ten minutes of messages on a link that stalls, for several tests."""
    return carry(link_of(STALLING), DENSE)


def stalls_of(arrivals, moments):
    """The delayed messages, stall by stall: [(end, moments of sending)]. Only without delay."""
    held = [(arrival, moments[number]) for arrival, number in arrivals
            if arrival != moments[number]]
    return [(end, [moment for _, moment in group])
            for end, group in groupby(held, itemgetter(0))]


# Delay and jitter ---------------------------------------------------------------------------------

def test_jitter_is_exponential_on_top_of_the_delay():
    arrivals = carry(link_of(SimulatorConfig(sensor_latency=0.02, sensor_jitter=0.01)), SPARSE)
    extra = sorted(arrival - number - 0.02 for arrival, number in arrivals)
    assert extra[0] >= -1e-9
    # 20000 numbers: the mean is good to 0.7 % (one sigma)
    assert sum(extra) / len(extra) == pytest.approx(0.01, rel=0.025)
    assert extra[len(extra) // 2] == pytest.approx(0.01 * math.log(2.0), rel=0.03)


# The cut ------------------------------------------------------------------------------------------

def test_what_is_under_way_when_the_cut_comes_is_held_up_and_afterwards_takes_its_time():
    link = link_of(SimulatorConfig(sensor_latency=0.5))
    link.send(['arrives', 'held'], [0.0, 0.25])
    link.configure(SimulatorConfig(sensor_latency=0.5, network_cut=True), 0.625)
    link.send(['late'], [8.75])
    assert link.pop(9.0) == [(0.5, 'arrives')]
    link.configure(SimulatorConfig(sensor_latency=0.5), 9.0)
    assert link.pop(9.5) == [(9.0, 'held'), (9.25, 'late')]


# Stalls, and other interruptions ------------------------------------------------------------------

@pytest.mark.parametrize('lengths', [(0.3, 4.3), (0.0, 0.4)])
def test_interruptions_are_half_open_intervals_of_the_lengths_and_the_rate_asked_for(lengths):
    every, seventh = (Interruptions(1.0, lengths, 100.0, seed=3) for _ in range(2))
    moments = [100.0 + moment for moment in DENSE]
    ends = [every.release(moment) for moment in moments]
    assert [seventh.release(moment) for moment in moments[::7]] == ends[::7]
    begins = {}
    for moment, end in zip(moments, ends):
        if end != moment:
            begins.setdefault(end, moment)
    taken = [end - begin for end, begin in begins.items()]
    middle, half = (lengths[1] + lengths[0]) / 2.0, (lengths[1] - lengths[0]) / 2.0
    assert lengths[0] - 0.001 <= min(taken) and max(taken) <= lengths[1]
    assert max(taken) > middle + 0.9 * half
    assert sum(taken) / len(taken) == pytest.approx(middle, abs=0.15 * half)
    # a Poisson process: mean 1 s, 37 % longer than that
    gaps = [begin - end for end, begin in zip(begins, list(begins.values())[1:])]
    assert len(gaps) > 150 and sum(gaps) / len(gaps) == pytest.approx(1.0, rel=0.15)
    assert sum(gap > 1.0 for gap in gaps) / len(gaps) == pytest.approx(math.exp(-1.0), abs=0.06)
    again, (end, begin) = Interruptions(1.0, lengths, 100.0, seed=3), next(iter(begins.items()))
    assert again.release(begin) == end and again.release(end) == end     # its end is free


def test_a_stall_holds_up_what_falls_into_it_until_its_end_and_nothing_else():
    arrivals = stalling_arrivals()
    assert [number for _, number in arrivals] == list(range(len(DENSE)))
    stalls = stalls_of(arrivals, DENSE)
    for end, moments in stalls:
        # messages of one interval, sent every millisecond, to within a millisecond of its end
        assert len(moments) == round((moments[-1] - moments[0]) * 1000) + 1
        assert moments[-1] < end <= moments[-1] + 0.001 + 1e-9
        assert end - moments[0] <= 0.3


def test_a_stall_counts_at_arrival_not_at_sending():
    direct = stalls_of(stalling_arrivals(), DENSE)
    late = carry(link_of(replace(STALLING, sensor_latency=0.5)), DENSE)
    held = [(arrival, DENSE[number]) for arrival, number in late
            if arrival - DENSE[number] > 0.5 + 1e-9]
    ends = {end for end, _ in direct}
    assert {arrival for arrival, _ in held} == ends
    assert [moment + 0.5 for _, moment in held[:20]] == pytest.approx(
        [moment for _, moments in direct for moment in moments][:20])


def test_one_stall_holds_up_both_directions():
    assert carry(link_of(STALLING, 'command'), DENSE) == stalling_arrivals()


def test_a_change_of_the_stalls_ends_the_present_one():
    first = stalls_of(stalling_arrivals(), DENSE)[0]
    link, middle = link_of(STALLING), (first[1][0] + first[0]) / 2.0
    link.send(['held'], [first[1][0]])
    assert link.pop(middle) == []
    link.configure(SimulatorConfig(), middle)
    assert link.pop(middle) == [(middle, 'held')]


# Seeds --------------------------------------------------------------------------------------------

ALL = SimulatorConfig(sensor_latency=0.02, sensor_jitter=0.01, stalls_per_min=40.0, longest_stall=0.5)


def test_the_seed_decides():
    moments = DENSE[:60000]
    assert carry(link_of(ALL, seed=3), moments) == carry(link_of(ALL, seed=3), moments)
    jitter = SimulatorConfig(sensor_jitter=0.01, command_jitter=0.01)
    for kind in jitter, STALLING:
        assert carry(link_of(kind, seed=3), moments) != carry(link_of(kind, seed=4), moments)
    assert carry(link_of(jitter, 'sensor'), SPARSE) != carry(link_of(jitter, 'command'), SPARSE)
