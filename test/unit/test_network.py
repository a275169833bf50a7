"""The network of the embedded robot: the effects of its delays, jitter, stalls and cuts."""
import math
from dataclasses import fields

import pytest
from carried import DENSE, SPARSE, STALLING, carry, link_of, stalls_of
from hypothesis import given, settings
from hypothesis import strategies as st

from tb3_labs.simulation.network import NETWORKS, Link, LinkSettings
from tb3_labs.simulation.simulator_config import SimulatorConfig


# Delay and jitter ---------------------------------------------------------------------------------

def test_a_quiet_link_takes_no_time():
    link = Link('commands', 1)
    assert link.is_clear
    link.send([0, 1, 2], [0.0, 0.5, 1.0])
    assert not link.is_clear
    assert link.take(0.5) == [(0.0, 0), (0.5, 1)]
    assert not link.is_clear
    assert link.take(1.0) == [(1.0, 2)] and link.is_clear


def test_a_delay_is_the_same_for_all():
    link = link_of(LinkSettings(delay=0.25))
    assert carry(link, [0.0, 0.125, 0.5], 0.2) == []
    assert link.take(0.375) == [(0.25, 0), (0.375, 1)]
    assert link.take(9.0) == [(0.75, 2)]


def test_jitter_is_exponential_on_top_of_the_delay():
    arrivals = carry(link_of(LinkSettings(delay=0.02, jitter=0.01)), SPARSE)
    extra = sorted(arrival - number - 0.02 for arrival, number in arrivals)
    mean = sum(extra) / len(extra)
    spread = math.sqrt(sum((e - mean) ** 2 for e in extra) / len(extra))
    assert extra[0] >= -1e-9
    # 20000 numbers: the mean is good to 0.7 %, the spread to 1.4 % (two sigma: twice that)
    assert mean == pytest.approx(0.01, rel=0.025)
    assert spread == pytest.approx(0.01, rel=0.05)
    assert extra[len(extra) // 2] == pytest.approx(0.01 * math.log(2.0), rel=0.03)
    assert sum(e > 0.03 for e in extra) / len(extra) == pytest.approx(math.exp(-3.0), rel=0.1)


def test_jitter_keeps_the_order():
    moments = DENSE[:20000]
    arrivals = carry(link_of(LinkSettings(delay=0.01, jitter=0.05)), moments)
    assert [number for _, number in arrivals] == list(range(len(moments)))
    assert [arrival for arrival, _ in arrivals] == sorted(arrival for arrival, _ in arrivals)
    assert all(arrival >= moments[number] + 0.01 for arrival, number in arrivals)
    # Some wait for a slower one that was sent before them, and arrive with it.
    assert len({arrival for arrival, _ in arrivals}) < len(arrivals) / 2


@pytest.mark.parametrize('lower', [LinkSettings(), LinkSettings(delay=0.1)])
def test_a_shorter_delay_lets_nothing_overtake(lower):
    link = link_of(LinkSettings(delay=1.0))
    link.send(['before'], [0.0])
    link.configure(lower, 0.5)
    link.send(['after', 'late'], [0.5, 2.0])
    assert link.take(5.0) == [(1.0, 'before'), (1.0, 'after'), (2.0 + lower.delay, 'late')]


def test_a_link_is_clear_again_when_the_last_slow_message_has_arrived():
    link = link_of(LinkSettings(delay=1.0))
    assert not link.is_clear
    link.send(['slow'], [0.0])
    link.configure(LinkSettings(), 0.5)
    assert not link.is_clear
    assert link.take(0.9) == [] and not link.is_clear
    assert link.take(1.0) == [(1.0, 'slow')] and link.is_clear
    link.configure(LinkSettings(jitter=0.1), 2.0)
    assert not link.is_clear
    link.configure(LinkSettings(), 3.0)
    assert link.is_clear


def test_what_has_arrived_when_the_settings_change_is_not_lost():
    link = link_of(LinkSettings(delay=0.5))
    link.send(['early', 'late'], [0.0, 1.0])
    link.configure(LinkSettings(), 1.0)
    assert not link.is_clear
    assert link.take(1.0) == [(0.5, 'early')]
    assert link.take(2.0) == [(1.5, 'late')] and link.is_clear


# The cut ------------------------------------------------------------------------------------------

@pytest.mark.parametrize('delay', [0.0, 0.25])
def test_a_cut_holds_up_everything_and_then_it_comes_at_once(delay):
    link = link_of(LinkSettings(delay=delay))
    assert carry(link, [0.0, 0.125], 0.5) == [(delay, 0), (0.125 + delay, 1)]
    link.configure(LinkSettings(delay=delay, is_cut=True), 0.5)
    assert carry(link, [0.5, 1.0, 5.0], 100.0) == []
    link.configure(LinkSettings(delay=delay), 100.0)
    link.send(['after'], [100.0])
    assert link.take(100.0 + delay) == [(100.0, 0), (100.0, 1), (100.0, 2),
                                        (100.0 + delay, 'after')]


def test_what_is_under_way_when_the_cut_comes_is_held_up_too():
    link = link_of(LinkSettings(delay=0.5))
    link.send(['arrives', 'held'], [0.0, 0.25])
    link.configure(LinkSettings(delay=0.5, is_cut=True), 0.625)
    assert link.take(9.0) == [(0.5, 'arrives')]
    link.configure(LinkSettings(delay=0.5), 9.0)
    assert link.take(9.0) == [(9.0, 'held')]


def test_what_is_still_under_way_when_the_cut_ends_takes_its_time():
    link = link_of(LinkSettings(delay=1.0, is_cut=True))
    link.send(['late'], [0.75])
    link.configure(LinkSettings(delay=1.0), 1.5)
    assert link.take(2.0) == [(1.75, 'late')]


# Seeds, and the length of steps -------------------------------------------------------------------

ALL = LinkSettings(delay=0.02, jitter=0.01, stalls_per_min=40.0, longest_stall=0.5)


def test_the_seed_decides():
    moments = DENSE[:60000]
    assert carry(link_of(ALL, seed=3), moments) == carry(link_of(ALL, seed=3), moments)
    assert carry(link_of(ALL, seed=3), moments) != carry(link_of(ALL, seed=4), moments)
    jitter = LinkSettings(jitter=0.01)
    assert carry(link_of(jitter, 'sensors'), SPARSE) != carry(link_of(jitter, 'commands'), SPARSE)
    assert stalls_of(carry(link_of(STALLING, seed=3), moments), moments) != stalls_of(
        carry(link_of(STALLING, seed=4), moments), moments)


@settings(max_examples=50, deadline=None)
@given(st.lists(st.floats(0.0, 2.0), min_size=1, max_size=30), st.integers(0, 1000))
def test_how_often_it_is_asked_changes_nothing(cuts, seed):
    often, once = link_of(ALL, seed=seed), link_of(ALL, seed=seed)
    now, arrivals, moments = 0.0, [], []
    for cut in cuts:
        sent = [now + k * cut / 10 for k in range(10)]
        now += cut
        often.send(sent, sent)
        arrivals += often.take(now)
        moments += sent
    once.send(moments, moments)
    assert arrivals == once.take(now)
    assert often.take(math.inf) == once.take(math.inf)


def test_a_direction_has_a_name():
    with pytest.raises(ValueError, match='both'):
        Link('both', 1)


# The named networks -------------------------------------------------------------------------------

@pytest.mark.parametrize('name, delay_ms, stalls, longest_ms', [
    ('quiet', 0, 0, 400), ('good', 8, 0, 400), ('busy', 15, 20, 300), ('bad', 30, 40, 500)])
def test_the_named_networks(name, delay_ms, stalls, longest_ms):
    config = SimulatorConfig(**NETWORKS[name])
    for direction in 'command', 'sensor':
        assert getattr(config, direction + '_latency') * 1000 == pytest.approx(delay_ms)
        assert getattr(config, direction + '_jitter') * 4000 == pytest.approx(delay_ms)
    assert config.stalls_per_min == stalls
    assert config.longest_stall * 1000 == pytest.approx(longest_ms)
    assert config.stalled == 'both' and not config.network_cut


def test_every_named_network_says_all_that_another_one_does():
    assert SimulatorConfig(**NETWORKS['quiet']) == SimulatorConfig()
    assert len({frozenset(network) for network in NETWORKS.values()}) == 1
    assert set(NETWORKS['bad']) <= {item.name for item in fields(SimulatorConfig)}
