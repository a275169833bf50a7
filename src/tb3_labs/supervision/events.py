"""An Event is a message that a person may have caused: a True, a False, or a turn. An Output is the
decision of a core, with log lines for the person.

A message is doubtful if it may repeat a message from before this node could hear its sender. This
holds for the first message on a connection, if the sender is older than this node, or had another
connection before: for a latched message always, for others until `REPEATS_WITHIN` has passed.

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
    """The age of a message, compared with the node that hears it."""

    NEW = 'it was sent after this node could hear its sender'
    RESTARTED = 'the same, by a new process that bears the name of an earlier sender'
    REPEATED = 'it may repeat a message from before this node could hear its sender'
    LATCHED = 'the same, and its sender latches'
    OLD = 'it was latched before this node began to listen'
    SAME = 'it has the stamp of the message before it, though the clock ran on: it is no news'

    @property
    def is_doubtful(self) -> bool:
        """May it be older than this node, or than a lost connection?"""
        return self in (Age.REPEATED, Age.LATCHED, Age.OLD, Age.SAME)


@dataclass(frozen=True)
class Event(Generic[Content]):
    """A message: its content, when it arrived [s], and its sender."""

    content: Content
    at: float
    sender: str = ''
    age: Age = Age.NEW
    #: Does the sender announce that it renews its permission?
    renews: bool = False
    #: When it was sent [s, sender's clock]; 0 if that is unknown.
    sent_at: float = 0.0


class SenderConnection(NamedTuple):
    """The connection on which the messages of one sender arrive."""

    sender: str
    process: str = ''         # another process may have the same name later
    since: float = -math.inf  # when the connection was made [s]
    latches: bool = False     # the sender repeats its last message to each new connection
    renews: bool = False      # see Event


class MessageAges:
    """Finds the Age of each message of one topic, by the connection on which it arrives."""

    def __init__(self, present: Iterable[str], now: float) -> None:
        """This node begins to listen now; `present`: the senders that were there before."""
        self._present, self._begun_at = frozenset(present), now
        self._latest: Dict[str, SenderConnection] = {}    # by the senders' names
        self._stamps: Dict[str, Tuple[float, float]] = {}    # the same: (stamp, clock)

    def age_of(self, connection: SenderConnection, now: float, stamp: float = 0.0,
               clock: float = 0.0) -> Age:
        """Returns the Age of a message that arrives on `connection` now. `stamp`: its stamp, or 0;
        `clock`: the time now on the clock of stamps. A driver that hangs repeats its stamp."""
        before, stamped = self._latest.get(connection.sender), self._stamps.get(connection.sender)
        self._latest[connection.sender] = connection
        self._stamps[connection.sender] = stamp, clock
        if before == connection:
            is_same = stamped and stamp and stamp == stamped[0] and clock != stamped[1]
            return Age.SAME if is_same else Age.NEW
        if before is None and connection.sender not in self._present:
            return Age.NEW
        is_restarted = before is not None and before.process != connection.process
        if is_restarted and connection.renews:    # it sends nothing before a person acts
            return Age.RESTARTED
        if connection.latches and before is None and now - self._begun_at < LATCHED_WITHIN:
            return Age.OLD    # if it had sent nothing before, its first message would come later
        if connection.latches and not connection.renews:
            return Age.LATCHED
        if now - connection.since < REPEATS_WITHIN:
            return Age.REPEATED
        return Age.RESTARTED if is_restarted else Age.NEW


class LogLine(NamedTuple):
    """A line of a core for its user; `warning`: is it logged as a warning?"""

    text: str
    warning: bool


class LogQueue:
    """Collects the lines until they are logged."""

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
    """The decision of a core: its node carries it out. A node may add fields."""

    #: The command to send, a turtlebot3.Twist2; zero is a stop. None: no command is due.
    command: Optional[Tuple[float, float]] = None
    #: Is one zero sent before the command, because the driver has changed?
    stops_first: bool = False
    #: Lines for the user.
    log_lines: Sequence[LogLine] = ()
    #: May the robot move, so that the clock must be looked at often?
    watched: bool = False

    @property
    def has_more(self) -> bool:
        """Is there anything to be carried out after the command?"""
        return bool(self.log_lines)
