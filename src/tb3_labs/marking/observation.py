"""What was observed of one node: plain data that can be judged, drawn, and kept in a file.

Units: seconds since the observation began, m/s, rad/s, metres, radians; the yaw of the true poses
is continuous over whole turns. Commands are those of the node that is judged, not of whoever else
moved the robot.
"""
import json
import math
from dataclasses import asdict, dataclass, field
from typing import Optional

import numpy as np


class NotSeen(Exception):
    """What a criterion needs did not take place; the reason, as one sentence."""


class NotOffered(NotSeen):
    """The node does not offer what a criterion is about."""


@dataclass
class Stimulus:
    """Something that was done to the node, and what happened meanwhile."""

    name: str
    begin: float
    end: float = math.nan
    printed: str = ''           # by the node, meanwhile
    lines: int = 0              # how many lines that were
    died: bool = False          # did the node end meanwhile?
    facts: dict = field(default_factory=dict)


@dataclass
class Run:
    """One life of the node, from its start to its end."""

    begin: float
    ready: Optional[float] = None         # when it listened to what it should; None: never
    end: Optional[float] = None
    ended_by_itself: bool = False
    printed: str = ''           # head and tail


@dataclass
class Observation:
    """All that was observed of one node."""

    lab: str
    node: str
    commands: list = field(default_factory=list)     # [time, linear, angular]
    truth: list = field(default_factory=list)        # [time, x, y, yaw]
    stimuli: list = field(default_factory=list)
    runs: list = field(default_factory=list)
    missing: dict = field(default_factory=dict)      # stimulus -> why there was none

    def to_json(self):
        """As text."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text):
        """From the text of :meth:`to_json`."""
        parts = json.loads(text)
        parts['stimuli'] = [Stimulus(**item) for item in parts['stimuli']]
        parts['runs'] = [Run(**item) for item in parts['runs']]
        return cls(**parts)

    @property
    def longest_gap(self):
        """The longest time the robot's true pose did not arrive [s]: the machine was busy then,
        and neither the robot nor the node could do what they should."""
        times = [row[0] for row in self.truth]
        return max([then - before for before, then in zip(times, times[1:])] + [0.0])

    def has(self, name):
        """Was there such a stimulus?"""
        return any(stimulus.name == name for stimulus in self.stimuli)

    def during(self, name, may_die=False):
        """The :class:`Scene` of a stimulus; NotSeen where there was none, or where the node died
        of it and may not."""
        for stimulus in self.stimuli:
            if stimulus.name == name:
                if stimulus.died and not may_die:
                    raise NotSeen('it ended in the middle of this: {}'.format(
                        last_words(stimulus.printed)))
                return Scene(self, stimulus)
        if name in self.missing:
            raise NotOffered(self.missing[name])
        raise NotSeen(self.why_missing())

    def why_missing(self):
        """Why a stimulus is missing: the node's own end, or it was never ready, or time was up."""
        if not self.runs:
            return 'it was never started'
        run = self.runs[-1]
        if run.ready is None:
            return self.why_not_ready(run)
        if run.ended_by_itself:
            return 'it had ended: {}'.format(last_words(run.printed))
        return 'the time was up before this was tried'

    @staticmethod
    def why_not_ready(run):
        """Why a run never was ready."""
        if run.ended_by_itself:
            return 'it ended at once: {}'.format(last_words(run.printed))
        return 'it ran, but never listened to the robot'


class Scene:
    """A stretch of an observation."""

    def __init__(self, observation, stimulus):
        self.facts, self.printed, self.lines = stimulus.facts, stimulus.printed, stimulus.lines
        self.begin, self.end = stimulus.begin, stimulus.end
        self.commands = _between(observation.commands, 3, self.begin, self.end)
        self.truth = _between(observation.truth, 4, self.begin, self.end)

    @property
    def moving(self):
        """The commands that are not zero."""
        return self.commands[np.any(self.commands[:, 1:] != 0.0, axis=1)]

    @property
    def turned_deg(self):
        """By how much the robot truly turned, left positive [deg]."""
        return math.degrees(self.truth[-1, 3] - self.truth[0, 3]) if len(self.truth) else 0.0

    @property
    def ahead(self):
        """How far the robot truly went, in the direction in which it looked first [m]."""
        if not len(self.truth):
            return 0.0
        x, y = self.truth[-1, 1:3] - self.truth[0, 1:3]
        return float(x * math.cos(self.truth[0, 3]) + y * math.sin(self.truth[0, 3]))


def _between(rows, columns, begin, end):
    rows = np.array(rows, dtype=float).reshape(-1, columns)
    return rows[(rows[:, 0] >= begin) & (rows[:, 0] <= end)]


def last_words(printed):
    """The last line that a node printed, or that it printed nothing."""
    lines = [line.strip() for line in printed.splitlines() if line.strip()]
    return repr(lines[-1][:160]) if lines else 'it printed nothing'
