"""The network between the simulated robot and a computer decides when each message arrives.

A link is one direction of the network. As in TCP, messages are not lost, and keep their order. A
message arrives after its `delay` and a random `jitter`, which is drawn for each message. If a
message would arrive during a stall, it waits for the end of the stall. A cut is a stall that lasts
until the setting is switched off. Both links have the same stalls.

Stalls begin at random (a Poisson process). A stall does not begin within another stall. Each kind
of random number has a separate generator with the seed. So calls of :meth:`NetworkLink.pop` do not
change these numbers.

Units: seconds. Edge cases: A stall does not delay a message that is due at the very end of the
stall. A change of delay or jitter does not change messages under way. A change of the stalls ends
the present stall. If messages follow each other fast, a message waits for earlier messages. So the
mean delay is more than delay and jitter together. Source: recordings of real TurtleBot3s over a
WLAN, which stalls for 0.1 to 0.4 s. A sender of 802.11 waits for a random time before each frame,
and tries again if the frame is lost. So some delays are much longer than the mean (Malone, Leith
and Dangerfield, "Inferring queue state by measuring delay in a WiFi network").
"""
import math
import random
from collections import deque
from typing import Any, Deque, Dict, List, Optional, Sequence, Tuple

from tb3_labs.simulation.simulator_config import SimulatorConfig

#: (moment [s], message that arrives then)
Arrival = Tuple[float, Any]


def _network(delay: float = 0.0, stalls_per_min: float = 0.0,
             longest_stall: float = SimulatorConfig.longest_stall) -> Dict[str, float]:
    # With this jitter one message in 55 takes twice the delay or more.
    return dict(command_latency=delay, sensor_latency=delay, command_jitter=delay / 4.0,
                sensor_jitter=delay / 4.0, stalls_per_min=stalls_per_min,
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

    def release(self, moment: float) -> float:
        """Returns the end of the stall at `moment` [s], or `moment` itself if the network does not
        stall then. `moment` is not before the moment of the last call."""
        while moment >= self._end:
            self._plan(self._end)
        return self._end if moment >= self._start else moment


class NetworkLink:
    """One direction of the network, 'sensor' or 'command'. Messages keep their order."""

    def __init__(self, direction: str, seed: int) -> None:
        self._names, self._seed = (direction + '_latency', direction + '_jitter'), seed
        self._random = random.Random(f'jitter of {direction}s {seed}')
        self._settings = SimulatorConfig()
        self._stalls: Optional[Stalls] = None
        self._in_flight: Deque[Arrival] = deque()    # the earliest message first
        self._last_due = -math.inf
        self._arrived: List[Arrival] = []

    def configure(self, settings: SimulatorConfig, now: float) -> None:
        self._arrived = self.pop(now)
        before, self._settings = self._settings, settings
        rate, longest = settings.stalls_per_min / 60.0, settings.longest_stall
        if rate != before.stalls_per_min / 60.0 or longest != before.longest_stall:
            self._stalls = None
            if rate:
                # Both links have this seed, so a stall delays the messages of both directions.
                self._stalls = Stalls(rate, longest, now, f'stalls {self._seed}')
        # the messages that waited for the end of a stall arrive now
        self._in_flight = deque((max(due, now), message) for due, message in self._in_flight)

    def send(self, messages: Sequence[Any], moments: Sequence[float]) -> None:
        """Send each of `messages` at its moment [s]."""
        delay, jitter = (getattr(self._settings, name) for name in self._names)
        latest, append = self._last_due, self._in_flight.append
        for message, moment in zip(messages, moments):
            due = moment + delay
            if jitter:
                due += self._random.expovariate(1.0 / jitter)
            if due > latest:
                latest = due
            append((latest, message))
        self._last_due = latest

    def pop(self, until: float) -> List[Arrival]:
        """Returns the messages that have arrived by `until` [s], in order of their arrival."""
        arrived, self._arrived = self._arrived, []
        in_flight, stalls = self._in_flight, self._stalls
        if not self._settings.network_cut:
            while in_flight and in_flight[0][0] <= until:
                arrival, message = in_flight[0]
                if stalls:
                    arrival = stalls.release(arrival)
                if arrival > until:
                    break
                in_flight.popleft()
                arrived.append((arrival, message))
        return arrived
