"""The network of the simulated robot delays its messages, by jitter, stalls and cuts."""
import math
from itertools import groupby
from operator import itemgetter

import pytest

from tb3_labs.simulation.network import NetworkLink
from tb3_labs.simulation.simulator_config import SimulatorConfig

SPARSE = [float(k) for k in range(20000)]           # no message waits for an earlier message [s]
DENSE = [k / 1000.0 for k in range(142000)]         # no stall is cut off at the end [s]
STALLING = SimulatorConfig(stalls_per_min=20.0, longest_stall=0.3)


def link_of(settings, direction='sensor', seed=1):
    link = NetworkLink(direction, seed)
    link.configure(settings, 0.0)
    return link


def carry(link, moments, until=math.inf):
    """Send messages at `moments`. Returns [(arrival, number)] of those that arrive by `until`."""
    link.send(range(len(moments)), moments)
    return link.pop(until)


@pytest.fixture(scope='module')
def arrivals():
    """The arrivals on a link that stalls."""
    return carry(link_of(STALLING), DENSE)


def stalls_of(arrivals, latency=0.0):
    """Returns [(end, moments of sending)] of each stall."""
    held = [(arrival, DENSE[number]) for arrival, number in arrivals
            if arrival - DENSE[number] > latency + 1e-9]
    return [(end, [moment for _, moment in group])
            for end, group in groupby(held, itemgetter(0))]


def test_jitter_is_exponential_on_top_of_the_delay():
    arrivals = carry(link_of(SimulatorConfig(sensor_latency=0.02, sensor_jitter=0.01)), SPARSE)
    extra = sorted(arrival - number - 0.02 for arrival, number in arrivals)
    assert extra[0] >= -1e-9
    # 20000 numbers: the mean is good to 0.7 % (one sigma)
    assert sum(extra) / len(extra) == pytest.approx(0.01, rel=0.025)
    assert extra[len(extra) // 2] == pytest.approx(0.01 * math.log(2.0), rel=0.03)


def test_a_cut_delays_the_messages_under_way_until_its_end():
    link = link_of(SimulatorConfig(sensor_latency=0.5))
    link.send(['arrives', 'held'], [0.0, 0.25])
    link.configure(SimulatorConfig(sensor_latency=0.5, network_cut=True), 0.625)
    link.send(['late'], [8.75])
    assert link.pop(9.0) == [(0.5, 'arrives')]
    link.configure(SimulatorConfig(sensor_latency=0.5), 9.0)
    assert link.pop(9.5) == [(9.0, 'held'), (9.25, 'late')]


def test_a_stall_delays_the_messages_within_it_to_its_end_in_both_directions(arrivals):
    assert [number for _, number in arrivals] == list(range(len(DENSE)))
    stalls = stalls_of(arrivals)
    assert len(stalls) > 20
    for end, moments in stalls:
        # a message was sent every millisecond
        assert len(moments) == round((moments[-1] - moments[0]) * 1000) + 1
        assert moments[-1] < end <= moments[-1] + 0.001 + 1e-9
        assert end - moments[0] <= 0.3
    assert carry(link_of(STALLING, 'command'), DENSE) == arrivals


def test_a_change_of_the_settings_ends_a_stall(arrivals):
    end, moments = stalls_of(arrivals)[0]
    link, middle = link_of(STALLING), (moments[0] + end) / 2.0
    link.send(['held'], moments[:1])
    assert link.pop(middle) == []
    link.configure(SimulatorConfig(), middle)
    assert link.pop(middle) == [(middle, 'held')]
