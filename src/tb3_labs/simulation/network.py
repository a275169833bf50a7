"""The network between the simulated robot and a computer decides when each message arrives.

A link is one direction of the network. As in TCP, messages are not lost, and keep their order. Each
message takes the same `latency`. A message that would arrive during a stall waits for the end of
the stall. A cut is a stall that lasts until the setting is switched off. Both links have the same
stalls.

Stalls begin at random (a Poisson process). A stall does not begin within another stall. The same
seed gives the same stalls, however often :meth:`NetworkLink.pop` is called.

Units: seconds. Edge cases: A stall does not delay a message that would arrive exactly at the end of
the stall. A change of the latency does not change messages under way. A change of the stalls ends
the present stall.
Source: recordings of real TurtleBot3s over a WLAN, which stalls for 0.1 to 0.4 s.
"""
import math
import random
from collections import deque
from typing import Any, Deque, Dict, List, Optional, Sequence, Tuple

from tb3_labs.simulation.simulator_config import SimulatorConfig

#: (moment [s], message that arrives then)
Arrival = Tuple[float, Any]


def _network(latency: float = 0.0, stalls_per_min: float = 0.0,
             longest_stall: float = SimulatorConfig.longest_stall) -> Dict[str, float]:
    return dict(command_latency=latency, sensor_latency=latency, stalls_per_min=stalls_per_min,
                longest_stall=longest_stall)


#: {name of a network: {field of SimulatorConfig: value}}
NETWORKS: Dict[str, Dict[str, float]] = {
    'quiet': _network(),
    'good': _network(0.008),
    'busy': _network(0.015, 20.0, 0.3),
    'bad': _network(0.030, 40.0, 0.5),
}


class Stalls:
    """The stalls of a network, as random intervals [start, end). The mean time between stalls is
    1 / `rate` [s]. The length of a stall is a uniform random number from 0 to `longest` [s]."""

    def __init__(self, rate: float, longest: float, since: float, seed: str) -> None:
        self._rate, self._longest = rate, longest
        self._random = random.Random(seed)
        self._plan(since)

    def _plan(self, after: float) -> None:
        self._start = after + self._random.expovariate(self._rate)
        self._end = self._start + self._random.uniform(0.0, self._longest)

    def delayed(self, moment: float) -> float:
        """Returns the end of the stall at `moment` [s], or `moment` itself if the network does not
        stall then. `moment` is not before the moment of the last call."""
        while moment >= self._end:
            self._plan(self._end)
        return self._end if moment >= self._start else moment


class NetworkLink:
    """One direction of the network, 'sensor' or 'command'. Messages keep their order."""

    def __init__(self, direction: str, seed: int) -> None:
        self._latency_field = direction + '_latency'
        self._seed = seed
        self._settings = SimulatorConfig()
        self._stalls: Optional[Stalls] = None
        self._in_flight: Deque[Arrival] = deque()    # the earliest message first
        self._last_due = -math.inf
        self._arrived: List[Arrival] = []

    def configure(self, settings: SimulatorConfig, now: float) -> None:
        self._arrived = self.pop(now)
        before, self._settings = self._settings, settings
        has_same_rate = settings.stalls_per_min == before.stalls_per_min
        if not has_same_rate or settings.longest_stall != before.longest_stall:
            self._stalls = None
            if settings.stalls_per_min:
                # Both links use the same seed, so a stall delays the messages of both directions.
                self._stalls = Stalls(settings.stalls_per_min / 60.0, settings.longest_stall, now,
                                      f'stalls {self._seed}')
        # messages that waited for the end of a stall are due now
        self._in_flight = deque((max(due, now), message) for due, message in self._in_flight)

    def send(self, messages: Sequence[Any], moments: Sequence[float]) -> None:
        """Send each of `messages` at its moment [s]."""
        latency = getattr(self._settings, self._latency_field)
        for message, moment in zip(messages, moments):
            self._last_due = max(self._last_due, moment + latency)
            self._in_flight.append((self._last_due, message))

    def pop(self, until: float) -> List[Arrival]:
        """Returns the messages that have arrived by `until` [s], in order of their arrival."""
        arrived, self._arrived = self._arrived, []
        if self._settings.network_cut:
            return arrived
        while self._in_flight:
            arrival, message = self._in_flight[0]
            if arrival <= until and self._stalls:
                arrival = self._stalls.delayed(arrival)
            if arrival > until:
                break
            arrived.append((arrival, message))
            self._in_flight.popleft()
        return arrived
