"""The observation of one node: plain data that can be judged, drawn, and kept in a file.

Units: seconds since the observation began, m/s, rad/s, metres, radians. The yaw of the true poses
is continuous over whole turns. The commands are those of the node that is judged; those of other
nodes are left out.
"""
import json
import math
from dataclasses import asdict, dataclass, field
from typing import Any, Dict, List, Optional

import numpy as np

#: The topics that the labs are about, as the handouts call them; all names are relative.
IMU = 'imu'
ODOM = 'odom'
JOY = 'joy'
MOUSE_INFO = 'mouse_info'
CTRL_RELINQ = 'ctrl_relinq'
CMD_VEL = 'cmd_vel'
#: The robot's own reset.
RESET = 'reset'
#: The true pose of the simulated robot.
TRUTH = 'ground_truth'

#: Keys of `facts` that several labs use. MOVED: did the node command a movement after it was asked
#: to? RESTED: did the robot come to rest? WAS_MOVING: did the robot move when the stimulus began?
MOVED, RESTED, WAS_MOVING = 'moved', 'rested', 'was_moving'
#: If the machine held up the robot for longer than this, the node was not judged fairly [s].
HELD_UP = 0.15
#: At most MOST_FINDINGS findings are kept of a node. Each of them, and each remark, has at most
#: LONGEST characters.
MOST_FINDINGS, LONGEST = 20, 2000


class NotSeen(Exception):
    """The thing that a criterion judges was not seen; the text is the reason, a clause."""


class NotOffered(NotSeen):
    """The node does not offer what a criterion judges."""


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
    unheard: List[str] = field(default_factory=list)    # it listened to them, nobody published them


@dataclass
class Observation:
    """Everything that was observed of one node."""

    lab: str
    node: str                                                    # package/file
    commands: List[List[float]] = field(default_factory=list)    # [time, linear, angular]
    truth: List[List[float]] = field(default_factory=list)       # [time, x, y, yaw]
    stimuli: List[Stimulus] = field(default_factory=list)
    runs: List[Run] = field(default_factory=list)
    missing: Dict[str, str] = field(default_factory=dict)        # stimulus -> why there is none
    remarks: List[str] = field(default_factory=list)             # sentences for the student
    broken: str = ''                                             # the error that ended the trial
    findings: List[str] = field(default_factory=list)            # sentences for the instructor
    #: The start of the latest stimulus that was looked at [s].
    looked_at: Optional[float] = None

    def to_json(self) -> str:
        """The observation as text."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> 'Observation':
        """The Observation that :meth:`to_json` wrote as this text."""
        parts = json.loads(text)
        parts['stimuli'] = [Stimulus(**item) for item in parts['stimuli']]
        parts['runs'] = [Run(**item) for item in parts['runs']]
        return cls(**parts)

    def note(self, finding: str) -> None:
        """Add a finding for the instructor, once; '' is not a finding."""
        finding = finding[:LONGEST]     # it may quote the node
        if finding and finding not in self.findings and len(self.findings) < MOST_FINDINGS:
            self.findings.append(finding)

    @property
    def longest_gap(self) -> float:
        """The longest time without a true pose of the robot [s]: the machine was busy then."""
        return float(np.diff([row[0] for row in self.truth]).max(initial=0.0))

    @property
    def unfair(self) -> str:
        """A sentence if the machine was too busy to judge the node fairly, else ''."""
        if self.longest_gap <= HELD_UP:
            return ''
        return ('The machine held the robot up for {:.2f} s (up to {:g} s are fair): the marks may '
                'be unfair.'.format(self.longest_gap, HELD_UP))

    def has(self, name: str) -> bool:
        """Was there a stimulus of this name?"""
        return any(stimulus.name == name for stimulus in self.stimuli)

    def during(self, name: str, may_die: bool = False) -> 'Scene':
        """The :class:`Scene` of a stimulus.

        ``NotOffered`` if the node does not offer what it needs. ``NotSeen`` if it is missing for
        another reason, or if the node ended during it, unless it `may_die`.
        """
        for stimulus in self.stimuli:
            if stimulus.name == name:
                self.looked_at = stimulus.begin
                if stimulus.died and not may_die:
                    raise NotSeen('it ended in the middle of this: {}'.format(
                        last_words(stimulus.printed)))
                return Scene(self, stimulus)
        if name in self.missing:
            raise NotOffered(self.missing[name])
        raise NotSeen(self.why_missing())

    def why_missing(self) -> str:
        """Why a stimulus is missing: the node ended, was never ready, or the time was up."""
        if not self.runs:
            return 'it was never started'
        run = self.runs[-1]
        if run.ended_by_itself:
            return 'it {}: {}'.format('ended at once' if run.ready is None else 'had ended',
                                      last_words(run.printed))
        if run.ready is not None:
            return 'the time was up before this was tried'
        return 'it ran, but never listened to the robot' + (
            ': it listens to {}, which nobody publishes'.format(' and '.join(run.unheard))
            if run.unheard else '')


class Scene:
    """The part of an observation that belongs to one stimulus.

    `commands` has rows of time, linear, angular; `truth` has rows of time, x, y, yaw.
    """

    def __init__(self, observation: Observation, stimulus: Stimulus) -> None:
        self.facts, self.printed, self.lines = stimulus.facts, stimulus.printed, stimulus.lines
        self.begin, self.end = stimulus.begin, stimulus.end
        self.commands = _between(observation.commands, 3, self.begin, self.end)
        self.truth = _between(observation.truth, 4, self.begin, self.end)

    @property
    def moving(self) -> np.ndarray:
        """The commands that are not zero, rows as in `commands`."""
        return self.commands[np.any(self.commands[:, 1:] != 0.0, axis=1)]

    def moving_after(self, seconds: float) -> np.ndarray:
        """Returns the commands that are not zero, more than `seconds` [s] after the start."""
        return self.moving[self.moving[:, 0] > self.begin + seconds]

    @property
    def turned_deg(self) -> float:
        """The angle by which the robot truly turned, left positive [deg]; 0 without a pose."""
        return math.degrees(self.truth[-1, 3] - self.truth[0, 3]) if len(self.truth) else 0.0


def _between(rows, columns, begin, end):
    rows = np.array(rows, dtype=float).reshape(-1, columns)
    return rows[(rows[:, 0] >= begin) & (rows[:, 0] <= end)]


def last_words(printed: str) -> str:
    """The last line that a node printed, in quotes, or a clause if there is none."""
    lines = [line.strip() for line in printed.splitlines() if line.strip()]
    return repr(lines[-1][:160]) if lines else 'it printed nothing'
