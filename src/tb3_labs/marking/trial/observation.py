"""A trial for its criteria: what was done to a node, and what the node did meanwhile.

All of it comes from the bag of the trial (:mod:`tb3_labs.marking.trial.ros_recording`).

Units: seconds since the recording began, m/s, rad/s, metres, radians. The yaw of the true poses
is continuous over whole turns. The commands come from the node that is judged; the marker's
commands are left out.
"""
import json
import math
from dataclasses import dataclass, field, replace
from typing import Any, Dict, List, Optional, Sequence, Type

import numpy as np

from tb3_labs.handout import CMD_VEL
from tb3_labs.marking.trial.printed import COLOUR, counted, exceptions, last_words
from tb3_labs.report.run_data import Kind, Poses, RunData, States, Values

#: The robot's own reset; all names of topics are relative.
RESET = 'reset'
#: The true pose of the simulated robot; the events of a trial; the output of its node.
TRUTH, EVENTS, PRINTED = 'ground_truth', 'trial', 'printed'
#: The node's own variables; see tb3_labs.watch.
VARIABLES = 'variables'

#: Keys of `facts` that several labs use. MOVED: did the node command a movement after its stimulus?
#: RESTED: did the robot come to rest? WAS_MOVING: did the robot move when the stimulus began?
MOVED, RESTED, WAS_MOVING = 'moved', 'rested', 'was_moving'
#: Key of the facts of a turn: the angle that was asked for [deg].
ASKED_DEG = 'asked_deg'
#: Keys of the facts of a drive. GOAL_POSE: the goal in the local frame. LOCAL_T_WORLD: the
#: transform from the robot's true frame to the local frame. Both are [x, y, yaw] in [m], [rad].
GOAL_POSE, LOCAL_T_WORLD = 'goal', 'local_T_world'
#: A node's line about a reset comes within this time of the call [s].
SAME_RESET = 1.0
#: If the machine held up the robot for longer than this, the node was not judged fairly [s].
HELD_UP = 0.15
#: At most MOST_FINDINGS findings are kept of a node, and as many remarks; each has at most LONGEST
#: characters.
MOST_FINDINGS, LONGEST = 20, 2000
NOT_FINITE = 'commands that are not finite numbers'
#: So many characters of a run's output are kept, from its beginning and from its end.
KEPT = 20000


class NotSeen(Exception):
    """The thing that a criterion judges was not seen; the text is the reason, a clause."""


class NotOffered(NotSeen):
    """The node does not have the topic or service that a criterion judges."""


class NotTried(NotSeen):
    """The node did not run when a criterion should have been tried."""


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
    unheard: List[str] = field(default_factory=list)    # a sensor's place; nobody published them
    needed: str = ''                # the topic to which it must listen
    nodes: List[str] = field(default_factory=list)      # their names at the master
    listens: List[str] = field(default_factory=list)
    publishes: Dict[str, str] = field(default_factory=dict)     # topic -> type
    unconnected: List[str] = field(default_factory=list)    # asked for, yet not heard
    interrupted: bool = False       # did the marker send Ctrl+C?
    status: Optional[int] = None    # exit status, if it ended by itself; -N: by signal N

    def ending(self, file: str = '') -> str:
        """A clause on its end; `file`: the node's file."""
        errors = exceptions(self.printed, file)
        if errors:
            return counted(errors[-1:])[0]
        if self.status == 0:
            return 'its main program was over, and nothing kept the node running'
        return last_words(self.printed)

    @property
    def never_ready(self) -> str:
        """A clause on a run that did not listen to the topic that it needs."""
        if self.needed and not self.nodes:
            return 'it ran, but never came to rospy.init_node()'
        if '/' + self.needed in self.listens:
            return 'it was not ready in time, though it listened to {}'.format(self.needed)
        others = [topic for topic in self.listens if topic not in self.unheard]
        return 'it ran, but never listened to {}{}'.format(
            self.needed or 'the robot',
            '; it listened to {}'.format(' and '.join(others)) if others else '')


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
    faults: List[str] = field(default_factory=list)              # on its text, if it loses points
    broken: str = ''                                             # the error that ended the trial
    findings: List[str] = field(default_factory=list)            # sentences for the instructor
    lost: Dict[str, int] = field(default_factory=dict)           # what is not in here, how often
    #: [time, in words] of commands that are not finite numbers
    odd: List[List[Any]] = field(default_factory=list)
    senders: List[List[str]] = field(default_factory=list)  # [name, process], at each change
    own_moves: List[List[float]] = field(default_factory=list)   # [begin, end] of the marker's
    mouse_up: int = 0       # the sign of y above the middle, by its own mouse client; 0: unknown
    assigned: Dict[str, List[int]] = field(default_factory=dict)    # variable -> lines of its file
    calls: List[List[Any]] = field(default_factory=list)    # of its reset: [time, pose, problem]
    run: Optional[RunData] = None                                # the recording

    @property
    def file(self) -> str:
        """The name of the node's file."""
        return self.node.rpartition('/')[2]

    @property
    def drivers(self) -> List[str]:
        """The programs that commanded the robot by turns."""
        processes = [process for _, process in self.senders]
        return sorted({name for number, (name, process) in enumerate(self.senders)
                       if process in processes[:number]})

    @property
    def gaps(self) -> List[str]:
        """Sentences on what is missing in this record, and on what must not be in it."""
        told = ['{} {} came on {}: they are not recorded, and not judged.'.format(
            number, what, CMD_VEL) for what, number in sorted(self.lost.items())]
        if self.drivers:
            told.append('{} sent commands by turns with another program.'.format(
                ' and '.join(self.drivers)))
        return told

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

    @property
    def deaf(self) -> str:
        """A clause if the node listens to a topic that nobody publishes in place of a sensor, or
        ''."""
        topics = sorted({topic for run in self.runs for topic in run.unheard})
        return 'it listens to {}, which nobody publishes'.format(
            ' and '.join(topics)) if topics else ''

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
                if stimulus.died and not may_die:
                    errors = exceptions(stimulus.printed, self.file)
                    raise NotSeen('it ended in the middle of this: {}'.format(
                        counted(errors[-1:])[0] if errors else last_words(stimulus.printed)))
                return Scene(self, stimulus)
        if name in self.missing:
            raise NotOffered(self.missing[name])
        raise NotTried(self.why_missing())

    def why_missing(self) -> str:
        """Why a stimulus is missing: the node ended, was never ready, or the time was over."""
        if not self.runs:
            return 'it was never started'
        run = self.runs[-1]
        if run.ended_by_itself:
            return 'it {}: {}'.format('ended at once' if run.ready is None else 'had ended',
                                      run.ending(self.file))
        if run.ready is None:
            return ': '.join(filter(None, [run.never_ready, self.deaf]))
        return 'the time was up before this was tried' if run.end is None else 'this was not tried'


class Scene(Stimulus):
    """The part of an observation that belongs to one stimulus.

    `commands` has rows of time, linear, angular; `truth` has rows of time, x, y, yaw.
    """

    def __init__(self, observation: Observation, stimulus: Stimulus) -> None:
        super().__init__(**vars(stimulus))
        self.seen = observation
        self.odd = [words for time, words in observation.odd if self.begin <= time <= self.end]
        self.commands = _between(observation.commands, 3, self.begin, self.end)
        self.truth = _between(observation.truth, 4, self.begin, self.end)

    @property
    def run(self) -> Run:
        """The run of the node in which it was."""
        before = [run for run in self.seen.runs if run.begin <= self.begin]
        return (before or self.seen.runs or [Run(self.begin)])[-1]

    @property
    def exceptions(self) -> List[str]:
        """The exceptions that the node printed in it."""
        return exceptions(self.printed, self.seen.file)

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


# -- from the recording

def observed(run: RunData, places: Sequence[str] = ()) -> Observation:
    """The Observation of a trial; `places`: beginnings of paths on the marking machine, which are
    left out of all texts. ``ValueError`` if the recording is not of a trial."""
    def cleaned(text: str) -> str:
        for place in places:
            text = text.replace(place, '')
        return text
    run = replace(run, log=replace(run.log, texts=np.array(
        list(map(cleaned, run.log.texts)), dtype=object)))
    truth = run.ground_truth
    seen = Observation('', '', run=run, commands=np.column_stack(
        [run.commands.arrival, run.commands.linear, run.commands.angular]).tolist(),
        truth=np.column_stack([truth.arrival, truth.x, truth.y, np.unwrap(truth.yaw)]).tolist())
    texts = [(at, None, words) for at, words in zip(run.printed.arrival, run.printed.words)]
    events = [(at, json.loads(cleaned(words)), '') for at, words in zip(
        run.events.arrival, run.events.words)]
    for at, event, text in sorted(texts + events, key=lambda each: each[0]):
        if event is None:
            _printed(seen, text, text.count('\n'))
        else:
            _take(seen, event.pop('kind'), float(at), event)
    if not seen.lab:
        raise ValueError('the recording has no trial')
    for each in seen.runs:
        text = each.printed = COLOUR.sub('', cleaned(each.printed))
        if len(text) > 2 * KEPT:
            each.printed = '{}\n...\n{}'.format(text[:KEPT], text[-KEPT:])
    seen.stimuli = [each for each in seen.stimuli if not math.isnan(each.end)]
    for stimulus in seen.stimuli:
        stimulus.printed = COLOUR.sub('', cleaned(stimulus.printed))
    seen.run = with_stimuli(run, seen)
    return seen


def with_stimuli(run: RunData, seen: Observation) -> RunData:
    """The recording of a trial with what was done to the node: starts, stimuli, letters, goals, and
    the resets by the node's lines, else by their calls. After a call that failed the node's frame
    is unknown: until the next start its variables are left out."""
    said, known = run.resets, np.ones(len(run.variables), bool)
    resets = np.column_stack([said.arrival, said.x, said.y, said.yaw]).tolist()
    for at, pose, problem in seen.calls:
        if problem:
            end = min([start.begin for start in seen.runs if start.begin > at], default=math.inf)
            known &= (run.variables.arrival < at) | (run.variables.arrival > end)
        elif not (np.abs(said.arrival - at) < SAME_RESET).any():
            resets.append([at, *pose])
    return replace(
        run, resets=samples_of(Poses, sorted(resets)), variables=run.variables.take(known),
        starts=tuple(start.begin for start in seen.runs),
        states=samples_of(States, [[each.begin, each.name] for each in seen.stimuli]),
        goals=samples_of(Poses, [[each.begin, *each.facts[GOAL_POSE]] for each in seen.stimuli
                                 if GOAL_POSE in each.facts]),
        letters=samples_of(Values, [row for each in seen.stimuli if ASKED_DEG in each.facts
                                    for row in ([each.begin, np.sign(each.facts[ASKED_DEG])],
                                                [each.end, 0.0])]))


def samples_of(kind: Type[Kind], rows: Sequence[Sequence[Any]]) -> Kind:
    """The Samples of these rows: time, and the other columns."""
    columns = list(zip(*rows))
    return kind(*(np.array(column, dtype=object if isinstance(column[0], str) else float)
                  for column in columns[:1] + columns)) if rows else kind.none()


def _printed(seen: Observation, text: str, lines: int) -> None:
    """Add an output of so many lines to the run and the stimulus that are not over."""
    for each in seen.runs[-1:]:
        each.printed += text
    for stimulus in seen.stimuli[-1:]:
        if math.isnan(stimulus.end):
            stimulus.printed = (stimulus.printed + text)[-KEPT:]
            stimulus.lines += lines


def _take(seen: Observation, kind: str, at: float, facts: Dict[str, Any]) -> None:
    """Take an event of a trial into its Observation."""
    if kind == 'trial':
        seen.lab, seen.node = facts['lab'], facts['node']
    elif kind == 'begin':
        seen.stimuli.append(Stimulus(facts['name'], at))
    elif kind == 'end':
        vars(seen.stimuli[-1]).update(facts, end=at)
    elif kind == 'start':
        seen.runs.append(Run(at, needed=facts['needed']))
    elif kind == 'ready':
        seen.runs[-1].ready = at
    elif kind == 'run':
        vars(seen.runs[-1]).update(facts)
    elif kind == 'stop':
        vars(seen.runs[-1]).update(facts, end=at)
    elif kind == 'unprinted':
        _printed(seen, '\n... {} characters are left out here ...\n'.format(facts['characters']),
                 facts['lines'])
    elif kind == 'sender':
        seen.senders.append([facts['name'], facts['process']])
    elif kind == 'odd':
        seen.lost[NOT_FINITE] = seen.lost.get(NOT_FINITE, 0) + 1
        seen.odd.append([at, facts['text']])
    elif kind == 'left out':
        seen.lost[facts['what']] = facts['number']
    elif kind == 'own move':
        seen.own_moves.append([at - facts['seconds'], at])
    elif kind == 'not offered':
        seen.missing.update(dict.fromkeys(facts['names'], facts['reason']))
    elif kind == 'program':
        seen.assigned = facts['assigned']
    elif kind == 'call' and 'pose' in facts:
        seen.calls.append([at, facts['pose'], facts['problem']])
    elif kind == 'mouse client':
        seen.mouse_up = facts['up']
    elif kind == 'fault':
        seen.faults.append(facts['text'])
    elif kind == 'broken':
        seen.broken = facts['text']
    elif kind in ('remark', 'finding'):
        known = seen.remarks if kind == 'remark' else seen.findings
        if facts['text'] not in known and len(known) < MOST_FINDINGS:
            known.append(facts['text'])
