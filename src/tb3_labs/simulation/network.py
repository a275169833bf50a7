"""Simulates the network between the robot and a computer and decides when each message arrives.

A link is one direction of the network. As in TCP, messages are not lost and keep their order. The
delay of a message is a constant latency plus a random jitter. A message that would arrive during a
stall arrives when the stall ends. A cut is a stall that lasts until the setting `network_cut` is
switched off. Stalls begin at random (a Poisson process) and delay both links. Stalls and jitter
have separate random generators, so stalls do not change the jitter.

Times are in seconds. A change of latency or jitter affects only messages that are sent after the
change. A change of the settings of stalls ends the current stall. A message also waits until the
earlier messages have arrived. So if messages follow each other fast, the mean delay exceeds the
latency plus the mean jitter. Source: recordings of real TurtleBot3s over a WLAN, with stalls of 0.1
to 0.4 s. Some delays are much longer than the mean, because a sender in a WLAN waits for a random
time before each packet and repeats a lost packet (Malone, Leith and Dangerfield, "Inferring queue
state by measuring delay in a WiFi network").
"""
import math
import random
from collections import deque
from typing import Any, Deque, Dict, List, Optional, Sequence, Tuple

from tb3_labs.simulation.simulator_config import SimulatorConfig

Arrival = Tuple[float, Any]    # (time of arrival [s], message)


def _network(delay: float = 0.0, stalls_per_min: float = 0.0,
             longest_stall: float = SimulatorConfig.longest_stall) -> Dict[str, float]:
    # With this jitter, the delay of one message in 55 is at least twice the latency.
    return dict(command_latency=delay, sensor_latency=delay, command_jitter=delay / 4.0,
                sensor_jitter=delay / 4.0, stalls_per_min=stalls_per_min,
                longest_stall=longest_stall)


#: {name of a network: {field of SimulatorConfig: value}}
NETWORKS: Dict[str, Dict[str, float]] = {
    'quiet': _network(),
    'good': _network(delay=0.008),
    'busy': _network(delay=0.015, stalls_per_min=20.0, longest_stall=0.3),
    'bad': _network(delay=0.030, stalls_per_min=40.0, longest_stall=0.5),
}


class Stalls:
    """The stalls of a network, as random intervals [start, end). The mean pause [s] between two
    stalls is 60 / `per_min`. The length [s] of a stall is uniformly random up to `longest`."""

    def __init__(self, per_min: float, longest: float, since: float, seed: str) -> None:
        self._stalls_per_second = per_min / 60.0
        self._longest = longest
        self._random = random.Random(seed)
        self._plan_stall(since)

    def _plan_stall(self, after: float) -> None:
        self._start = after + self._random.expovariate(self._stalls_per_second)
        self._end = self._start + self._random.uniform(0.0, self._longest)

    def release_time(self, moment: float) -> float:
        """Returns the end [s] of the stall if the network stalls at `moment` [s], else `moment`.
        From call to call, `moment` must not go back."""
        while moment >= self._end:
            self._plan_stall(self._end)
        return self._end if moment >= self._start else moment


class NetworkLink:
    """One direction of the network: 'sensor' from the robot, or 'command' to the robot."""

    def __init__(self, direction: str, seed: int) -> None:
        self._direction = direction
        self._seed = seed
        self._random = random.Random(f'jitter of {direction}s {seed}')
        self._settings = SimulatorConfig()
        self._stalls: Optional[Stalls] = None
        self._in_flight: Deque[Arrival] = deque()    # the earliest message first
        self._last_due = -math.inf
        self._arrived: List[Arrival] = []

    def configure(self, settings: SimulatorConfig, now: float) -> None:
        self._arrived = self.pop(now)
        previous, self._settings = self._settings, settings
        per_min, longest = settings.stalls_per_min, settings.longest_stall
        if (per_min, longest) != (previous.stalls_per_min, previous.longest_stall):
            self._stalls = None
            if per_min:    # both links have the same seed, so a stall delays both directions
                self._stalls = Stalls(per_min, longest, since=now, seed=f'stalls {self._seed}')
        # messages that waited for the end of the old stall arrive now
        self._in_flight = deque((max(due, now), message) for due, message in self._in_flight)

    def send(self, messages: Sequence[Any], moments: Sequence[float]) -> None:
        """Send each of `messages` at the moment [s] that has the same place in `moments`."""
        settings = self._settings
        if self._direction == 'command':
            latency, jitter = settings.command_latency, settings.command_jitter
        else:
            latency, jitter = settings.sensor_latency, settings.sensor_jitter
        for message, moment in zip(messages, moments):
            due = moment + latency
            if jitter:
                due += self._random.expovariate(1.0 / jitter)
            self._last_due = max(self._last_due, due)
            self._in_flight.append((self._last_due, message))

    def pop(self, until: float) -> List[Arrival]:
        """Returns the new messages that arrive up to `until` [s], in order of arrival."""
        arrived, self._arrived = self._arrived, []
        while self._in_flight and not self._settings.network_cut:
            arrival, message = self._in_flight[0]
            if self._stalls:
                arrival = self._stalls.release_time(arrival)
            if arrival > until:
                break
            self._in_flight.popleft()
            arrived.append((arrival, message))
        return arrived
