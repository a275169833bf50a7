"""The criteria judge a node by its Observation: the stimuli of a trial, and the node's reactions.

:mod:`tb3_labs.marking.trial.from_bag` reads an Observation from the bag of a trial.

Units: seconds since the recording began, m/s, rad/s, metres, radians. The yaw of the true poses is
continuous over whole turns. An Observation does not contain the marker's own commands.
"""
import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Dict, Iterator, List, Optional, Sequence, Tuple

import numpy as np

from tb3_labs.recording.run_data import ImuSamples, OdometrySamples, RunData

#: A trial sends Ctrl+C up to three times, because rospy may lose the final message of a node.
CTRL_C = ('Ctrl+C', 'Ctrl+C again', 'Ctrl+C a third time')
TIME, LINEAR, ANGULAR = range(3)    # the columns of an array of commands
#: Keys of a stimulus's `facts`. A pose or a transform is [x [m], y [m], yaw [rad]].
MOVED = 'moved'                     # the node commanded a movement during the stimulus
RESTED = 'rested'                   # the robot came to rest
WAS_MOVING = 'was_moving'           # the robot was moving when the stimulus began
REQUESTED_DEG = 'asked_deg'         # the requested angle [deg] of a turn
GOAL_POSE = 'goal'                  # the goal of a drive, in the local frame
LOCAL_T_WORLD = 'local_T_world'     # the transform from the true frame to the local frame
#: A busy machine delays the simulated robot. In a fair trial, no gap between two true poses is
#: longer than this time [s].
MAX_FAIR_GAP = 0.15
MAX_FINDINGS = 20           # An Observation has at most so many findings, and so many remarks.
MAX_SENTENCE_LENGTH = 2000  # characters of a finding or a remark
#: The marker counts commands that are not finite numbers, but does not record them.
NOT_FINITE = 'commands that are not finite numbers'
#: The recording of a submission that had no trial.
NO_RECORDING = RunData('', 0.0, 0.0, ImuSamples.none(), OdometrySamples.none())


class NotObserved(Exception):
    """A criterion cannot be judged. The exception's text is a clause that says why."""


class NotOffered(NotObserved):
    """The node does not have the topic or the service that a criterion judges."""


class NotTried(NotObserved):
    """The node did not get the stimulus of a criterion, because the node did not run."""


class Ended(NotObserved):
    """The node ended during a stimulus. The exception's text is the node's last output."""


@dataclass
class Stimulus:
    """One action of the marker on the node, and the node's output."""

    name: str
    begin: float
    end: float = math.nan
    printed: str = ''           # the last part of the node's output during the stimulus
    line_count: int = 0         # the number of lines in the whole output during the stimulus
    died: bool = False          # the node ended during the stimulus
    facts: Dict[str, Any] = field(default_factory=dict)


@dataclass
class NodeProcess:
    """A process of the node. A trial starts the node several times."""

    begin: float
    ready: Optional[float] = None   # the time at which the node was ready; None if it never was
    end: Optional[float] = None     # None while the process runs
    ended_by_itself: bool = False
    printed: str = ''               # the first part and the last part of the output
    #: The topics that the node subscribes to although nobody publishes them. The list is empty if
    #: the node subscribes to all topics that it needs, because an extra topic does no harm.
    silent_topics: List[str] = field(default_factory=list)
    needed_topic: str = ''                            # the topic to which the node must subscribe
    nodes: List[str] = field(default_factory=list)    # the node's names at the ROS master
    subscribed_topics: List[str] = field(default_factory=list)
    published_topics: Dict[str, str] = field(default_factory=dict)      # {topic: type}
    #: The needed topics to which the node subscribes without a connection to the robot.
    unconnected_topics: List[str] = field(default_factory=list)
    #: The exit status of a process that the marker did not end; -N if signal N ended the process.
    status: Optional[int] = None


@dataclass
class Observation:
    """The recording and the events of the trial of one node."""

    lab: str
    node: str                   # package/file
    recording: RunData = NO_RECORDING
    #: (name, start time [s]) of each tried part of the lab.
    parts: List[Tuple[str, float]] = field(default_factory=list)
    stimuli: List[Stimulus] = field(default_factory=list)
    processes: List[NodeProcess] = field(default_factory=list)
    not_offered: Dict[str, str] = field(default_factory=dict)   # {stimulus: reason}
    remarks: List[str] = field(default_factory=list)    # sentences for the student
    marker_error: str = ''      # the marker's own error, which ended the trial
    findings: List[str] = field(default_factory=list)   # sentences for the instructor
    #: {kind of message: the number of messages that were not recorded}
    omitted_counts: Dict[str, int] = field(default_factory=dict)
    #: [time, text] of each command that is not a finite number.
    not_finite: List[List[Any]] = field(default_factory=list)
    #: [begin, end] of each movement that the marker commanded.
    marker_moves: List[List[float]] = field(default_factory=list)
    #: The sign of y in the student's mouse client for the upper half of the screen; 0 if unknown.
    mouse_y_sign: int = 0
    #: {variable: the lines of the node's file that assign the variable}
    assigned: Dict[str, List[int]] = field(default_factory=dict)
    #: [time, pose, problem] of each call of the node's reset service.
    reset_calls: List[List[Any]] = field(default_factory=list)
    #: The timeline shows the current verdict at this time [s], the start of the judged stimulus.
    #: The method `enter_scene` sets this time. It sets None if the stimulus was not tried.
    moment: Optional[float] = None

    @property
    def file(self) -> str:
        return self.node.rpartition('/')[2]

    @property
    def commands(self) -> np.ndarray:
        """The node's commands as an array with the columns time, linear, angular."""
        commands = self.recording.commands
        return np.column_stack([commands.arrival, commands.linear, commands.angular])

    @property
    def truth(self) -> np.ndarray:
        """The robot's true poses as an array with the columns time, x, y, yaw."""
        poses = self.recording.ground_truth
        return np.column_stack([poses.arrival, poses.x, poses.y, np.unwrap(poses.yaw)])

    @property
    def longest_gap(self) -> float:
        """The longest gap [s] between two true poses."""
        return float(np.diff(self.truth[:, 0]).max(initial=0.0))

    @property
    def clause_on_silent_topics(self) -> str:
        """A clause on the silent_topics of the node's processes; '' if there are none."""
        topics = {topic for process in self.processes for topic in process.silent_topics}
        names = ' and '.join(sorted(topics))
        return f'it listens to {names}, which nobody publishes' if topics else ''

    def part_intervals(self) -> List[Tuple[str, float, float]]:
        """Returns (name, begin [s], end [s]) of each tried part of the lab."""
        ends = [begin for _, begin in self.parts[1:]] + [math.inf]
        return [(name, begin, end) for (name, begin), end in zip(self.parts, ends)]

    def has_stimulus(self, name: str) -> bool:
        """Returns True if the node got the stimulus `name`."""
        return any(stimulus.name == name for stimulus in self.stimuli)

    def enter_scene(self, name: str, may_die: bool = False) -> 'Scene':
        """Sets `moment` to the start of the stimulus `name`. Returns the Scene of this stimulus.
        Raises ``NotOffered`` if the node does not have the topic or the service that the stimulus
        needs, and ``NotTried`` if the stimulus was not tried for another reason. Raises ``Ended``
        if the node ended during the stimulus, and `may_die` is false."""
        self.moment = None
        stimulus = next((stimulus for stimulus in self.stimuli if stimulus.name == name), None)
        if stimulus is None:
            if name in self.not_offered:
                raise NotOffered(self.not_offered[name])
            raise NotTried
        self.moment = stimulus.begin
        if stimulus.died and not may_die:
            raise Ended(stimulus.printed)
        return Scene(self, stimulus)

    def enter_scenes(self, names: Sequence[str], may_die: bool = False) -> Iterator['Scene']:
        """Yields the Scenes of the tried stimuli in `names`. If no stimulus was tried, raises the
        exception of `enter_scene` for the first name."""
        entered_names = [name for name in names if self.has_stimulus(name)] or [names[0]]
        return (self.enter_scene(name, may_die) for name in entered_names)

    def fastest_speed(self, commands: np.ndarray, column: int) -> float:
        """Returns the greatest absolute speed in a `column` of the commands, LINEAR or ANGULAR.
        Sets `moment` to the start of the stimulus in which the node commanded this speed."""
        speeds = np.abs(commands[:, column])
        fastest = speeds.argmax()
        begins = [stimulus.begin for stimulus in self.stimuli]
        self.moment = max(begin for begin in begins if begin <= commands[fastest, TIME])
        return float(speeds[fastest])


class Scene(Stimulus):
    """A stimulus with the node's commands and the robot's true poses during the stimulus.

    The columns of `commands` are time, linear, angular. The columns of `truth` are time, x, y, yaw.
    """

    def __init__(self, observation: Observation, stimulus: Stimulus) -> None:
        super().__init__(**vars(stimulus))
        self.observation = observation
        self.not_finite = [text for time, text in observation.not_finite
                           if self.begin <= time <= self.end]

    @cached_property
    def commands(self) -> np.ndarray:
        return self._rows_during(self.observation.commands)

    @cached_property
    def truth(self) -> np.ndarray:
        return self._rows_during(self.observation.truth)

    def _rows_during(self, rows: np.ndarray) -> np.ndarray:
        time = rows[:, TIME]
        return rows[(time >= self.begin) & (time <= self.end)]

    @property
    def process(self) -> NodeProcess:
        """The process of the node that ran when the stimulus began."""
        earlier = [process for process in self.observation.processes
                   if process.begin <= self.begin]
        return earlier[-1] if earlier else NodeProcess(self.begin)

    @property
    def moving_commands(self) -> np.ndarray:
        """The rows of `commands` that are not zero."""
        is_moving = np.any(self.commands[:, LINEAR:] != 0.0, axis=1)
        return self.commands[is_moving]

    def commands_before_and_after(self, seconds: float) -> Tuple[np.ndarray, np.ndarray]:
        """Returns the commands in the first `seconds` [s], and the commands after this time."""
        is_later = self.commands[:, TIME] > self.begin + seconds
        return self.commands[~is_later], self.commands[is_later]

    @property
    def turned_deg(self) -> float:
        """The angle [deg] of the robot's true turn, left positive; 0 if no true pose arrived."""
        if not len(self.truth):
            return 0.0
        _, _, _, turn = self.truth[-1] - self.truth[0]
        return math.degrees(turn)
