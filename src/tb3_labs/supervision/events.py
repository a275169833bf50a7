"""The IncomingMessage that a node's core (its part without ROS) gets, and the Output of the core.

A message is *doubtful* if its sender may have sent it before this node started, or before both were
connected. Only the first message on a connection can be older than the connection. This message can
be older only if its sender existed before this node, or had an earlier connection. If this message
is not latched, it is doubtful only within `MAX_REPEAT_GAP` after the connection was made.

A sender *repeats* a goal or a turn if it sends the same content again within `MAX_REPEAT_GAP`. If a
repeated request was ended, its later repetitions are refused until the sender changes the content,
or pauses. If a request was ended before it was repeated, the sender can send it again immediately.
"""
import math
from dataclasses import dataclass
from enum import Enum
from typing import (
    Any, Callable, Dict, Generic, Iterable, List, NamedTuple, Optional, Sequence, Tuple, TypeVar)

from tb3_labs.supervision.timeouts import MAX_REPEAT_GAP, MAX_TRANSIT_TIME, SleepMonitor

Content = TypeVar('Content')


class Novelty(Enum):
    """How new a message is. A message may be from before this node could hear its sender."""

    NEW = 'it was sent after this node could hear its sender'
    RESTARTED = 'it is new, and its sender is a new process that has the name of an earlier sender'
    REPEATED = 'it may repeat a message from before this node could hear its sender'
    LATCHED = 'it may be from before this node could hear its sender, which latches'
    OLD = 'it was latched before this node began to listen'
    SAME_STAMP = 'it has the stamp of the message before it, though the clock ran on'

    @property
    def is_doubtful(self) -> bool:
        """Returns True if the message may be old, so that it may not be what a person wants now."""
        return self in (Novelty.REPEATED, Novelty.LATCHED, Novelty.OLD, Novelty.SAME_STAMP)


@dataclass(frozen=True)
class IncomingMessage(Generic[Content]):
    """A message that a person may have caused, such as a request for a turn."""

    content: Content
    arrived_at: float    # time of arrival [s]
    sender: str = ''
    novelty: Novelty = Novelty.NEW
    has_renewals: bool = False    # the sender announces renewals of its permission
    sent_at: float = 0.0          # time of sending [s, sender's clock]; 0 if unknown


class SenderConnection(NamedTuple):
    sender: str
    process: str = ''                  # address of the process that has the sender's name now
    connected_at: float = -math.inf    # time [s] at which the connection was made
    is_latched: bool = False           # the sender repeats its last message to each new connection
    has_renewals: bool = False         # as in IncomingMessage


class NoveltyFinder:
    """Finds the Novelty of each message of one topic, from the connection on which it arrived."""

    def __init__(self, earlier_senders: Iterable[str], now: float) -> None:
        """This node begins to listen at `now`. The `earlier_senders` existed before `now`."""
        self._earlier_senders = frozenset(earlier_senders)
        self._began_at = now
        self._latest: Dict[str, SenderConnection] = {}       # latest one of each sender
        self._stamps: Dict[str, Tuple[float, float]] = {}    # each sender's latest (stamp, clock)

    def find(self, connection: SenderConnection, now: float, stamp: float = 0.0,
             clock: float = 0.0) -> Novelty:
        """Returns the Novelty of a message that arrives now. `stamp` is the message's stamp, or 0.
        `clock` is `now` on the stamps' clock."""
        sender = connection.sender
        previous = self._latest.get(sender)
        last_stamp, last_clock = self._stamps.get(sender, (0.0, 0.0))
        self._latest[sender] = connection
        self._stamps[sender] = stamp, clock

        if previous != connection:
            return self._novelty_of_first(connection, previous, now)
        is_same_stamp = stamp != 0.0 and stamp == last_stamp
        if is_same_stamp and clock != last_clock:    # the sender's device driver may hang
            return Novelty.SAME_STAMP
        return Novelty.NEW

    def _novelty_of_first(self, connection: SenderConnection,
                          previous: Optional[SenderConnection], now: float) -> Novelty:
        if previous is None and connection.sender not in self._earlier_senders:
            return Novelty.NEW
        is_restarted = previous is not None and previous.process != connection.process
        if is_restarted and connection.has_renewals:    # the new process has no old grant to renew
            return Novelty.RESTARTED
        came_early = previous is None and now - self._began_at < MAX_TRANSIT_TIME
        if connection.is_latched and came_early:
            return Novelty.OLD    # a person cannot send a new message so soon
        if connection.is_latched and not connection.has_renewals:
            return Novelty.LATCHED
        if now - connection.connected_at < MAX_REPEAT_GAP:
            return Novelty.REPEATED
        return Novelty.RESTARTED if is_restarted else Novelty.NEW


@dataclass
class SenderRequest:
    """The latest request of one sender. The sender may have repeated this request."""

    content: object
    latest_at: float            # time [s] of the latest message
    is_repeated: bool = False   # the request was sent more than once
    is_ended: bool = False      # further repetitions of the request are refused
    message: Any = None         # the caller may store the latest message here


class SenderRequests:
    """The latest request of each sender since the sender's last pause."""

    def __init__(self, sleep: SleepMonitor) -> None:
        self._sleep = sleep
        self._requests: Dict[str, SenderRequest] = {}    # by sender

    def on_request(self, sender: str, content: object, now: float) -> SenderRequest:
        """Store the latest request of `sender`. Call this even for a refused request."""
        # while this process sleeps, it hears nothing, but the senders may not pause
        if now - self._sleep.woke_at > MAX_REPEAT_GAP:
            self._requests = {name: request for name, request in self._requests.items()
                              if now - request.latest_at <= MAX_REPEAT_GAP}
        request = self.find(sender, content)
        if request is None:
            request = SenderRequest(content, now)
            self._requests[sender] = request
        else:
            request.is_repeated = True
            request.latest_at = now
        return request

    def find(self, sender: str, content: object) -> Optional[SenderRequest]:
        """Returns the latest request of `sender`; None if its content is not `content`."""
        request = self._requests.get(sender)
        if request is None or request.content != content:
            return None
        return request

    def end_repetitions(self, matches: Optional[Callable[[SenderRequest], bool]] = None) -> None:
        """From now on, refuse each repeated request for which ``matches(request)`` is True. Without
        `matches`, refuse all repeated requests."""
        for request in self._requests.values():
            if request.is_repeated and (matches is None or matches(request)):
                request.is_ended = True


class LogLine(NamedTuple):
    text: str
    is_warning: bool    # the line is logged as a warning


class Queue(List[Content]):
    """Entries that wait, in order, until the node takes them."""

    def pop_all(self) -> List[Content]:
        entries = list(self)
        self.clear()
        return entries


class LogQueue(Queue[LogLine]):
    def add(self, text: str) -> None:
        self.append(LogLine(text, is_warning=False))

    def warn(self, text: str) -> None:
        self.append(LogLine(text, is_warning=True))


@dataclass(frozen=True)
class Output:
    """The decision of a core, which the node carries out. A core may have its own subclass."""

    #: The turtlebot3.Twist2 that the node must send; None if no command is due. Zero is a stop.
    command: Optional[Tuple[float, float]] = None
    #: Another source of commands begins to drive, so the node sends one zero before the command.
    must_stop_first: bool = False
    log_lines: Sequence[LogLine] = ()    # lines for the user
    needs_fast_ticks: bool = False       # the node must look at the clock often

    @property
    def has_other_work(self) -> bool:
        """Returns True if the node must do more than send the command."""
        return bool(self.log_lines)
