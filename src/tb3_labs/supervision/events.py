"""An Event is a message that a person may have caused: a True, a False, or a turn. An Output is the
decision of a core, with log lines for the person.

A message is doubtful if it may repeat a message from before this node could hear the sender. The
first message on a connection is doubtful if the sender is older than this node, or had another
connection before. A latched message stays doubtful, other messages only for `REPEATS_WITHIN`.

Units: seconds on a clock that never stands still and never goes back (`at`).
"""
import math
from dataclasses import dataclass
from enum import Enum
from typing import (
    Dict, Generic, Iterable, List, NamedTuple, Optional, Sequence, Tuple, TypeVar)

from tb3_labs.supervision.timeouts import LATCHED_WITHIN, REPEATS_WITHIN

Content = TypeVar('Content')


class Age(Enum):
    """The age of a message, compared with the node that receives the message."""

    NEW = 'it was sent after this node could hear its sender'
    RESTARTED = 'the same, by a new process that bears the name of an earlier sender'
    REPEATED = 'it may repeat a message from before this node could hear its sender'
    LATCHED = 'the same, and its sender latches'
    OLD = 'it was latched before this node began to listen'
    SAME = 'it has the stamp of the message before it, though the clock ran on: it is no news'

    @property
    def is_doubtful(self) -> bool:
        """May the message be older than this node, or than a lost connection?"""
        return self in (Age.REPEATED, Age.LATCHED, Age.OLD, Age.SAME)


@dataclass(frozen=True)
class Event(Generic[Content]):
    """A message, and all that is known about its sender and its age."""

    content: Content
    #: Time of arrival [s].
    at: float
    sender: str = ''
    age: Age = Age.NEW
    #: Does the sender announce that it renews its permission?
    renews: bool = False
    #: Time of sending [s, sender's clock]; 0 if unknown.
    sent_at: float = 0.0


class SenderConnection(NamedTuple):
    """The connection on which the messages of one sender arrive."""

    sender: str
    process: str = ''         # another process may have the same name later
    since: float = -math.inf  # time at which the connection was made [s]
    latches: bool = False     # the sender repeats its last message to each new connection
    renews: bool = False      # see Event


class MessageAges:
    """Finds the Age of each message of one topic, by the connection of the message."""

    def __init__(self, present: Iterable[str], now: float) -> None:
        """`now`: this node begins to listen; `present`: the senders that exist before."""
        self._present, self._begun_at = frozenset(present), now
        self._latest: Dict[str, SenderConnection] = {}    # by the senders' names
        self._stamps: Dict[str, Tuple[float, float]] = {}    # by the senders: (stamp, clock)

    def age_of(self, connection: SenderConnection, now: float, stamp: float = 0.0,
               clock: float = 0.0) -> Age:
        """Returns the Age of a message that arrives now. `stamp`: the message's stamp, or 0;
        `clock`: the present time on the clock of stamps. A driver that hangs repeats a stamp."""
        before, stamped = self._latest.get(connection.sender), self._stamps.get(connection.sender)
        self._latest[connection.sender] = connection
        self._stamps[connection.sender] = stamp, clock
        if before == connection:
            is_same = stamped and stamp and stamp == stamped[0] and clock != stamped[1]
            return Age.SAME if is_same else Age.NEW
        if before is None and connection.sender not in self._present:
            return Age.NEW
        is_restarted = before is not None and before.process != connection.process
        if is_restarted and connection.renews:    # sends nothing before a person acts
            return Age.RESTARTED
        if connection.latches and before is None and now - self._begun_at < LATCHED_WITHIN:
            return Age.OLD    # a first message would come later
        if connection.latches and not connection.renews:
            return Age.LATCHED
        if now - connection.since < REPEATS_WITHIN:
            return Age.REPEATED
        return Age.RESTARTED if is_restarted else Age.NEW


class LogLine(NamedTuple):
    """A line of a core for the user."""

    text: str
    warning: bool    # is the line logged as a warning?


class LogQueue:
    """Collects the lines of a core until its node logs them."""

    def __init__(self) -> None:
        self._waiting: List[LogLine] = []

    def add(self, text: str, warning: bool = False) -> None:
        self._waiting.append(LogLine(text, warning))

    def pop_all(self) -> List[LogLine]:
        """Returns all lines since the last call."""
        lines, self._waiting = self._waiting, []
        return lines


@dataclass(frozen=True)
class Output:
    """The decision of a core, which the node of the core carries out. A node may add fields."""

    #: The command to send, a turtlebot3.Twist2. Zero is a stop. None: a command is not due.
    command: Optional[Tuple[float, float]] = None
    #: Must the node send one zero before the command, because the driver has changed?
    stops_first: bool = False
    #: Lines for the user.
    log_lines: Sequence[LogLine] = ()
    #: Must the node look at the clock often, because the robot may move?
    watched: bool = False

    @property
    def has_more(self) -> bool:
        """Must the node do anything after sending the command?"""
        return bool(self.log_lines)
