"""The network's stalls: their rate, length and direction, and the messages that they delay."""
import math
from dataclasses import replace

import pytest
from carried import DENSE, STALLING, carry, link_of, stalling_arrivals, stalls_of

from tb3_labs.simulation.network import LinkSettings


def test_a_stall_holds_up_what_falls_into_it_until_its_end_and_nothing_else():
    arrivals = stalling_arrivals()
    assert [number for _, number in arrivals] == list(range(len(DENSE)))
    stalls = stalls_of(arrivals, DENSE)
    for end, moments in stalls:
        # messages of one interval, sent every millisecond, to within a millisecond of its end
        assert len(moments) == round((moments[-1] - moments[0]) * 1000) + 1
        assert moments[-1] < end <= moments[-1] + 0.001 + 1e-9
        assert end - moments[0] <= 0.3


def test_stalls_are_as_frequent_and_as_long_as_asked_for():
    lengths = [len(moments) / 1000 for _, moments in stalls_of(
        carry(link_of(STALLING, seed=2), DENSE), DENSE)]
    # 3 s to the next one, 0.15 s long on average: 190.5 in ten minutes, give or take 13
    assert 150 < len(lengths) < 230
    # uniform: 190 numbers give the mean to 0.006 s, and a longest one near the limit
    assert sum(lengths) / len(lengths) == pytest.approx(0.15, abs=0.02)
    assert 0.28 < max(lengths) <= 0.301


def test_a_stall_begins_at_any_time_after_the_last_one():
    stalls = stalls_of(carry(link_of(LinkSettings(stalls_per_min=60.0, longest_stall=0.1)),
                             DENSE), DENSE)
    gaps = [moments[0] - end for (end, _), (_, moments) in zip(stalls, stalls[1:])]
    # a Poisson process: mean 1 s, 37 % longer than that, 10 % shorter than 0.105 s
    assert sum(gaps) / len(gaps) == pytest.approx(1.0, rel=0.15)
    assert sum(gap > 1.0 for gap in gaps) / len(gaps) == pytest.approx(math.exp(-1.0), abs=0.06)
    assert sum(gap < 0.105 for gap in gaps) / len(gaps) == pytest.approx(0.1, abs=0.04)


def test_a_stall_counts_at_arrival_not_at_sending():
    direct = stalls_of(stalling_arrivals(), DENSE)
    late = carry(link_of(replace(STALLING, delay=0.5)), DENSE)
    held = [(arrival, DENSE[number]) for arrival, number in late
            if arrival - DENSE[number] > 0.5 + 1e-9]
    ends = {end for end, _ in direct}
    assert {arrival for arrival, _ in held} == ends
    assert [moment + 0.5 for _, moment in held[:20]] == pytest.approx(
        [moment for _, moments in direct for moment in moments][:20])


@pytest.mark.parametrize('every', [7, 1900, 31000])
def test_stalls_are_the_same_whatever_is_sent(every):
    arrivals = [arrival for arrival, _ in stalling_arrivals()]
    assert [arrival for arrival, _ in carry(link_of(STALLING), DENSE[::every])] == (
        arrivals[::every])


def test_one_stall_holds_up_both_directions():
    both = [stalls_of(carry(link_of(STALLING, direction), DENSE), DENSE)
            for direction in ('sensors', 'commands')]
    assert len(both[0]) > 150 and both[0] == both[1]


def test_one_stall_holds_up_both_directions_also_when_the_other_joins_later():
    one = replace(STALLING, stalled='sensors')
    ends = []
    for direction, sent in (('sensors', DENSE), ('commands', DENSE[::7])):
        link = link_of(one, direction)
        carry(link, sent[:len(sent) // 2], 300.0)
        link.configure(STALLING, 300.0)
        rest = sent[len(sent) // 2:]
        ends.append([end for end, moments in stalls_of(carry(link, rest), rest)
                     if len(moments) * (sent[1] - sent[0]) > 0.02 and end > 300.1])
    assert len(ends[1]) > 60 and set(ends[1]) <= set(ends[0])


@pytest.mark.parametrize('stalled, held', [('sensors', 'sensors'), ('commands', 'commands')])
def test_a_stall_of_one_direction_leaves_the_other_alone(stalled, held):
    for direction in ('sensors', 'commands'):
        link = link_of(replace(STALLING, stalled=stalled), direction)
        arrivals = carry(link, DENSE)
        assert bool(stalls_of(arrivals, DENSE)) == (direction == held)
        assert link.is_clear == (direction != held)


def test_a_change_of_the_stalls_ends_the_present_one():
    first = stalls_of(stalling_arrivals(), DENSE)[0]
    link, middle = link_of(STALLING), (first[1][0] + first[0]) / 2.0
    link.send(['held'], [first[1][0]])
    assert link.take(middle) == []
    link.configure(LinkSettings(), middle)
    assert not link.is_clear
    assert link.take(middle) == [(middle, 'held')] and link.is_clear


def test_what_changes_nothing_of_the_stalls_leaves_them_alone():
    link, arrivals = link_of(STALLING), []
    for second in range(600):
        moments = DENSE[1000 * second:1000 * (second + 1)]
        link.configure(replace(STALLING, delay=1e-9 * (second % 2)), float(second))
        link.send(moments, moments)
        arrivals += link.take(second + 0.999)
    ends = {round(end, 6) for end, _ in stalls_of(stalling_arrivals(), DENSE)}
    assert ends <= {round(arrival, 6) for arrival, _ in arrivals}
