"""A trial as the criteria judge it: what was done to a node, and what the node did meanwhile.

An Observation is read from the bag of the trial (:mod:`tb3_labs.marking.trial.from_bag`).

Units: seconds since the recording began, m/s, rad/s, metres, radians. The yaw of the true poses
is continuous over whole turns. The commands are those of the judged node, without the marker's own.
"""
import math
from dataclasses import dataclass, field
from typing import Any, Dict, Iterator, List, Optional, Sequence, Tuple

import numpy as np

from tb3_labs.report.run_data import ImuSamples, OdometrySamples, RunData

#: The last stimuli. A node gets up to three Ctrl+C, since rospy may lose the node's last message.
CTRL_C = ('Ctrl+C', 'Ctrl+C again', 'Ctrl+C a third time')
#: Keys of a stimulus's `facts`. MOVED: did the node command a movement after the stimulus began?
#: RESTED: did the robot come to rest? WAS_MOVING: did the robot move when the stimulus began?
MOVED, RESTED, WAS_MOVING = 'moved', 'rested', 'was_moving'
#: Key of the facts of a turn: the requested angle [deg].
REQUESTED_DEG = 'asked_deg'
#: Keys of the facts of a drive. GOAL_POSE: the goal in the local frame. LOCAL_T_WORLD: the
#: transform from the robot's true frame to the local frame. Both are [x, y, yaw] in [m], [rad].
GOAL_POSE, LOCAL_T_WORLD = 'goal', 'local_T_world'
#: A busy machine holds up the simulated robot. A trial is fair if no gap between two true poses is
#: longer than this [s].
LONGEST_FAIR_GAP = 0.15
#: An Observation has at most MOST_FINDINGS findings and as many remarks, each of at most LONGEST
#: characters.
MOST_FINDINGS, LONGEST = 20, 2000
#: The name of the commands that are counted, but not recorded.
NOT_FINITE = 'commands that are not finite numbers'
#: The recording of a node that was never tried.
NO_RUN = RunData('', 0.0, 0.0, ImuSamples.none(), OdometrySamples.none())


class NotObserved(Exception):
    """A criterion cannot be judged, since its stimulus had no effect; the text is the reason, a
    clause."""


class NotOffered(NotObserved):
    """The node does not have the topic or service that a criterion judges."""


class NotTried(NotObserved):
    """The node did not run when a criterion should have been tried."""


class Ended(NotObserved):
    """The node ended during a stimulus; the text is the node's output during the stimulus."""


@dataclass
class Stimulus:
    """One action of the marker on the node, and the node's reaction."""

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
    ready: Optional[float] = None   # when it had subscribed to its topic; None if it never did
    end: Optional[float] = None     # None if it still runs
    ended_by_itself: bool = False
    printed: str = ''               # the begin and the end of its output
    #: The topics without a publisher to which it subscribes, if it lacks a sensor's topic.
    unheard: List[str] = field(default_factory=list)
    needed: str = ''                # the topic to which it must subscribe
    nodes: List[str] = field(default_factory=list)      # its names at the master
    listens: List[str] = field(default_factory=list)    # its subscribed topics
    publishes: Dict[str, str] = field(default_factory=dict)     # topic -> type
    #: The subscribed topics for which it has no connection to the robot.
    unconnected: List[str] = field(default_factory=list)
    status: Optional[int] = None    # exit status, if it ended by itself; -N means by signal N


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
    faults: List[str] = field(default_factory=list)      # faults in the text of its file
    marker_error: str = ''      # the marker's own error, which ended the trial
    findings: List[str] = field(default_factory=list)            # sentences for the instructor
    #: kind of message -> how many messages were not recorded
    omitted: Dict[str, int] = field(default_factory=dict)
    #: [time, text] of the commands that are not finite numbers
    not_finite: List[List[Any]] = field(default_factory=list)
    #: [begin, end] of the movements that the marker commanded
    own_moves: List[List[float]] = field(default_factory=list)
    mouse_up: int = 0       # the sign of y above the middle in its own mouse client; 0 if unknown
    assigned: Dict[str, List[int]] = field(default_factory=dict)    # variable -> lines of its file
    #: [time, pose, problem] of each call of its reset service
    calls: List[List[Any]] = field(default_factory=list)
    #: The begin of the stimulus that `scene` returned last [s]; None if it was not tried.
    moment: Optional[float] = None

    @property
    def file(self) -> str:
        """The name of the node's file."""
        return self.node.rpartition('/')[2]

    @property
    def commands(self) -> np.ndarray:
        """The node's commands: rows of time, linear, angular."""
        sent = self.run.commands
        return np.column_stack([sent.arrival, sent.linear, sent.angular])

    @property
    def truth(self) -> np.ndarray:
        """The true poses: rows of time, x, y, yaw."""
        true = self.run.ground_truth
        return np.column_stack([true.arrival, true.x, true.y, np.unwrap(true.yaw)])

    @property
    def longest_gap(self) -> float:
        """The longest gap between two true poses [s]."""
        return float(np.diff(self.truth[:, 0]).max(initial=0.0))

    @property
    def unpublished_topic(self) -> str:
        """A clause on the topics that nobody publishes, to which the node subscribes in place of a
        sensor's topic; '' if there are none."""
        topics = sorted({topic for run in self.runs for topic in run.unheard})
        return f"it listens to {' and '.join(topics)}, which nobody publishes" if topics else ''

    def has(self, name: str) -> bool:
        """Was the stimulus of this name tried?"""
        return any(stimulus.name == name for stimulus in self.stimuli)

    def scene(self, name: str, may_die: bool = False) -> 'Scene':
        """Returns the Scene of the stimulus of this name.

        Raises ``NotOffered`` if the node lacks the topic or service that the stimulus needs,
        ``NotTried`` if the stimulus was not tried for another reason, ``Ended`` if the node ended
        during the stimulus, unless it `may_die`.
        """
        stimulus = next((each for each in self.stimuli if each.name == name), None)
        self.moment = None if stimulus is None else stimulus.begin
        if stimulus is None:
            raise NotOffered(self.missing[name]) if name in self.missing else NotTried()
        if stimulus.died and not may_die:
            raise Ended(stimulus.printed)
        return Scene(self, stimulus)

    def scenes(self, names: Sequence[str], may_die: bool = False) -> Iterator['Scene']:
        """Yields the Scene of each of these stimuli that was tried. If no stimulus was tried, it
        raises what `scene` raises for the first name."""
        tried = [name for name in names if self.has(name)] or names[:1]
        return (self.scene(name, may_die) for name in tried)

    def greatest_speed(self, commands: np.ndarray, column: int) -> float:
        """Returns the greatest speed in a column of commands, and sets `moment` to the begin of its
        stimulus."""
        at, speed = max(zip(commands[:, 0], np.abs(commands[:, column])), key=lambda row: row[1])
        self.moment = max(each.begin for each in self.stimuli if each.begin <= at)
        return float(speed)


class Scene(Stimulus):
    """One stimulus, and the part of the observation from its begin to its end.

    `commands` has rows of time, linear, angular; `truth` has rows of time, x, y, yaw.
    """

    def __init__(self, observation: Observation, stimulus: Stimulus) -> None:
        super().__init__(**vars(stimulus))
        self.observed = observation
        self.not_finite = [text for time, text in observation.not_finite
                           if self.begin <= time <= self.end]
        self.commands, self.truth = (
            rows[(rows[:, 0] >= self.begin) & (rows[:, 0] <= self.end)]
            for rows in (observation.commands, observation.truth))

    @property
    def run(self) -> Run:
        """The run of the node during this stimulus."""
        before = [run for run in self.observed.runs if run.begin <= self.begin]
        return (before or self.observed.runs or [Run(self.begin)])[-1]

    @property
    def moving(self) -> np.ndarray:
        """The rows of `commands` that are not zero."""
        return self.commands[np.any(self.commands[:, 1:] != 0.0, axis=1)]

    def split(self, seconds: float) -> Tuple[np.ndarray, np.ndarray]:
        """Returns the commands in the first `seconds` [s], and the later ones."""
        is_late = self.commands[:, 0] > self.begin + seconds
        return self.commands[~is_late], self.commands[is_late]

    @property
    def turned_deg(self) -> float:
        """The angle by which the robot truly turned, left positive [deg]; 0 without a pose."""
        return math.degrees(self.truth[-1, 3] - self.truth[0, 3]) if len(self.truth) else 0.0
