"""A trial for its criteria: what was done to a node, and what the node did meanwhile.

All of it comes from the bag of the trial (:mod:`tb3_labs.marking.trial.from_bag`).

Units: seconds since the recording began, m/s, rad/s, metres, radians. The yaw of the true poses
is continuous over whole turns. The commands come from the node that is judged; the marker's
commands are left out.
"""
import math
from dataclasses import dataclass, field
from typing import Any, Dict, Iterator, List, Optional, Sequence, Tuple

import numpy as np

from tb3_labs.report.run_data import ImuSamples, OdometrySamples, RunData

#: The stimuli at the end. A node gets up to three Ctrl+C, since rospy may lose its last message.
CTRL_C = ('Ctrl+C', 'Ctrl+C again', 'Ctrl+C a third time')
#: Keys of `facts` that several labs use. MOVED: did the node command a movement after its stimulus?
#: RESTED: did the robot come to rest? WAS_MOVING: did the robot move when the stimulus began?
MOVED, RESTED, WAS_MOVING = 'moved', 'rested', 'was_moving'
#: Key of the facts of a turn: the angle that was asked for [deg].
REQUESTED_DEG = 'asked_deg'
#: Keys of the facts of a drive. GOAL_POSE: the goal in the local frame. LOCAL_T_WORLD: the
#: transform from the robot's true frame to the local frame. Both are [x, y, yaw] in [m], [rad].
GOAL_POSE, LOCAL_T_WORLD = 'goal', 'local_T_world'
#: If the machine held up the robot for longer than this, the node was not judged fairly [s].
LONGEST_FAIR_GAP = 0.15
#: At most MOST_FINDINGS findings are kept of a node, and as many remarks; each has at most LONGEST
#: characters.
MOST_FINDINGS, LONGEST = 20, 2000
#: The recording of a node that was never tried.
NO_RUN = RunData('', 0.0, 0.0, ImuSamples.none(), OdometrySamples.none())


class NotObserved(Exception):
    """The thing that a criterion judges was not seen; the text is the reason, a clause."""


class NotOffered(NotObserved):
    """The node does not have the topic or service that a criterion judges."""


class NotTried(NotObserved):
    """The node did not run when a criterion should have been tried."""


class Ended(NotObserved):
    """The node ended in the middle of a stimulus; the text is what it printed meanwhile."""


@dataclass
class Stimulus:
    """One thing that was done to the node, and the node's reaction."""

    name: str
    begin: float
    end: float = math.nan
    printed: str = ''           # the node's output during the stimulus
    lines: int = 0              # number of lines in this output
    died: bool = False          # did the node end during the stimulus?
    facts: Dict[str, Any] = field(default_factory=dict)


@dataclass
class Run:
    """One process of the node, from its start to its end."""

    begin: float
    ready: Optional[float] = None   # when it listened to its topic; None: never
    end: Optional[float] = None     # None: it still runs
    ended_by_itself: bool = False
    printed: str = ''               # head and tail
    #: Topics without a publisher, to which it listens in place of a sensor's.
    unheard: List[str] = field(default_factory=list)
    needed: str = ''                # the topic to which it must listen
    nodes: List[str] = field(default_factory=list)      # their names at the master
    listens: List[str] = field(default_factory=list)
    publishes: Dict[str, str] = field(default_factory=dict)     # topic -> type
    unconnected: List[str] = field(default_factory=list)    # asked for, yet not heard
    status: Optional[int] = None    # exit status, if it ended by itself; -N: by signal N


@dataclass
class Observation:
    """Everything that was observed of one node."""

    lab: str
    node: str                                                    # package/file
    run: RunData = NO_RUN                                        # the recording
    #: (part of the lab, its begin [s]), in their order
    parts: List[Tuple[str, float]] = field(default_factory=list)
    stimuli: List[Stimulus] = field(default_factory=list)
    runs: List[Run] = field(default_factory=list)
    missing: Dict[str, str] = field(default_factory=dict)        # stimulus -> why there is none
    remarks: List[str] = field(default_factory=list)             # sentences for the student
    faults: List[str] = field(default_factory=list)      # of its text; shown if it loses points
    broken: str = ''                                             # the error that ended the trial
    findings: List[str] = field(default_factory=list)            # sentences for the instructor
    lost: Dict[str, int] = field(default_factory=dict)           # what is not in here, how often
    #: [time, in words] of commands that are not finite numbers
    odd: List[List[Any]] = field(default_factory=list)
    own_moves: List[List[float]] = field(default_factory=list)   # [begin, end] of the marker's
    mouse_up: int = 0       # the sign of y above the middle, by its own mouse client; 0: unknown
    assigned: Dict[str, List[int]] = field(default_factory=dict)    # variable -> lines of its file
    calls: List[List[Any]] = field(default_factory=list)    # of its reset: [time, pose, problem]
    #: The start of the stimulus that was looked at last [s]; None: no stimulus that was tried.
    moment: Optional[float] = None

    @property
    def file(self) -> str:
        """The name of the node's file."""
        return self.node.rpartition('/')[2]

    @property
    def commands(self) -> np.ndarray:
        """Rows of time, linear, angular."""
        sent = self.run.commands
        return np.column_stack([sent.arrival, sent.linear, sent.angular])

    @property
    def truth(self) -> np.ndarray:
        """Rows of time, x, y, yaw: the true poses."""
        true = self.run.ground_truth
        return np.column_stack([true.arrival, true.x, true.y, np.unwrap(true.yaw)])

    @property
    def longest_gap(self) -> float:
        """The longest time without a true pose of the robot [s]: the machine was busy then."""
        return float(np.diff(self.truth[:, 0]).max(initial=0.0))

    @property
    def deaf(self) -> str:
        """A clause on a topic without a publisher to which the node listens in place of a sensor's
        topic; '' if there is none."""
        topics = sorted({topic for run in self.runs for topic in run.unheard})
        return f"it listens to {' and '.join(topics)}, which nobody publishes" if topics else ''

    def has(self, name: str) -> bool:
        """Was there a stimulus of this name?"""
        return any(stimulus.name == name for stimulus in self.stimuli)

    def during(self, name: str, may_die: bool = False) -> 'Scene':
        """The :class:`Scene` of a stimulus.

        ``NotOffered`` if the node does not offer what it needs, ``NotTried`` if it is missing for
        another reason, ``Ended`` if the node ended during it, unless it `may_die`.
        """
        stimulus = next((each for each in self.stimuli if each.name == name), None)
        self.moment = None if stimulus is None else stimulus.begin
        if stimulus is None:
            raise NotOffered(self.missing[name]) if name in self.missing else NotTried()
        if stimulus.died and not may_die:
            raise Ended(stimulus.printed)
        return Scene(self, stimulus)

    def each(self, names: Sequence[str], may_die: bool = False) -> Iterator['Scene']:
        """The Scene of each of these stimuli that was tried; if none was, as `during` the first."""
        tried = [name for name in names if self.has(name)] or names[:1]
        return (self.during(name, may_die) for name in tried)

    def fastest(self, commands: np.ndarray, column: int) -> float:
        """The greatest speed of a column of commands; `moment`: its stimulus's begin."""
        at, speed = max(zip(commands[:, 0], np.abs(commands[:, column])), key=lambda row: row[1])
        self.moment = max(each.begin for each in self.stimuli if each.begin <= at)
        return float(speed)


class Scene(Stimulus):
    """The part of an observation that belongs to one stimulus.

    `commands` has rows of time, linear, angular; `truth` has rows of time, x, y, yaw.
    """

    def __init__(self, observation: Observation, stimulus: Stimulus) -> None:
        super().__init__(**vars(stimulus))
        self.observed = observation
        self.odd = [words for time, words in observation.odd if self.begin <= time <= self.end]
        self.commands, self.truth = (
            rows[(rows[:, 0] >= self.begin) & (rows[:, 0] <= self.end)]
            for rows in (observation.commands, observation.truth))

    @property
    def run(self) -> Run:
        """The run of the node in which it was."""
        before = [run for run in self.observed.runs if run.begin <= self.begin]
        return (before or self.observed.runs or [Run(self.begin)])[-1]

    @property
    def moving(self) -> np.ndarray:
        """The commands that are not zero, rows as in `commands`."""
        return self.commands[np.any(self.commands[:, 1:] != 0.0, axis=1)]

    def split(self, seconds: float) -> Tuple[np.ndarray, np.ndarray]:
        """Returns the commands in the first `seconds` [s], and the later ones."""
        is_late = self.commands[:, 0] > self.begin + seconds
        return self.commands[~is_late], self.commands[is_late]

    @property
    def turned_deg(self) -> float:
        """The angle by which the robot truly turned, left positive [deg]; 0 without a pose."""
        return math.degrees(self.truth[-1, 3] - self.truth[0, 3]) if len(self.truth) else 0.0
