"""Reads the Observation from the bag of a trial, which ros_recording.py wrote."""
import json
import math
import re
from dataclasses import replace
from typing import Any, Dict, Sequence, Type

import numpy as np

from tb3_labs.marking.trial.observation import (
    GOAL_POSE, MOST_FINDINGS, NOT_FINITE, REQUESTED_DEG, Observation, Run, Stimulus)
from tb3_labs.report.bag.ros_bag import read_run
from tb3_labs.report.run_data import Numbers, Poses, RunData, SamplesType, States

#: A node's line about a reset belongs to the call of a reset that is at most this far away [s].
SAME_RESET = 1.0
#: At most this many characters of a run's output are read from its begin, and as many from its end.
MOST_PRINTED = 20000
#: The colours of a text on a terminal.
COLOUR = re.compile(r'\x1b\[[\d;]*m')
#: kind of event -> the list of the Observation to which its sentence is added
SENTENCES = {'remark': 'remarks', 'finding': 'findings', 'fault': 'faults'}


def read_trial(path: Any, places: Sequence[str] = ()) -> Observation:
    """Returns the Observation in the bag of a trial. `places` are beginnings of paths on the
    marking machine: they are removed from all texts. Raises ``ValueError`` if the bag is not that
    of a trial."""
    def cleaned(text: str) -> str:
        for place in places:
            text = text.replace(place, '')
        return text
    run = read_run(str(path))
    run = replace(run, log=replace(run.log, texts=np.array(
        list(map(cleaned, run.log.texts)), dtype=object)))
    observation = Observation('', '', run)
    texts = [(at, None, words) for at, words in zip(run.printed.arrival, run.printed.words)]
    events = [(at, json.loads(cleaned(words)), '') for at, words in zip(
        run.events.arrival, run.events.words)]
    for at, event, text in sorted(texts + events, key=lambda each: each[0]):
        if event is None:
            _printed(observation, text, text.count('\n'))
        else:
            _add_event(observation, event.pop('kind'), float(at), event)
    if not observation.lab:
        raise ValueError('the recording has no trial')
    observation.stimuli = [each for each in observation.stimuli if not math.isnan(each.end)]
    for each in observation.runs + observation.stimuli:
        each.printed = COLOUR.sub('', cleaned(each.printed))
    for start in observation.runs:
        if len(start.printed) > 2 * MOST_PRINTED:
            start.printed = '{}\n...\n{}'.format(
                start.printed[:MOST_PRINTED], start.printed[-MOST_PRINTED:])
    observation.run = with_stimuli(run, observation)
    return observation


def with_stimuli(run: RunData, observation: Observation) -> RunData:
    """Returns the recording of a trial with the marker's actions: starts, stimuli, letters, goals,
    resets. The time of a reset is that of the node's line, or of the call if there is no line.
    After a call that failed the node's frame is unknown: the variables from then until the next
    start are removed."""
    declared, known = run.resets, np.ones(len(run.variables), bool)
    resets = np.column_stack([declared.arrival, declared.x, declared.y, declared.yaw]).tolist()
    for at, pose, problem in observation.calls:
        if problem:
            end = min([start.begin for start in observation.runs if start.begin > at],
                      default=math.inf)
            known &= (run.variables.arrival < at) | (run.variables.arrival > end)
        elif not (np.abs(declared.arrival - at) < SAME_RESET).any():
            resets.append([at, *pose])
    goals = [[each.begin, *each.facts[GOAL_POSE]] for each in observation.stimuli
             if GOAL_POSE in each.facts]
    letters = [row for each in observation.stimuli if REQUESTED_DEG in each.facts
               for row in ([each.begin, np.sign(each.facts[REQUESTED_DEG])], [each.end, 0.0])]
    return replace(
        run, resets=samples_from_rows(Poses, sorted(resets)), variables=run.variables.take(known),
        starts=tuple(start.begin for start in observation.runs),
        states=samples_from_rows(States, [[each.begin, each.name] for each in observation.stimuli]),
        goals=samples_from_rows(Poses, goals), letters=samples_from_rows(Numbers, letters))


def samples_from_rows(kind: Type[SamplesType], rows: Sequence[Sequence[Any]]) -> SamplesType:
    """Returns the Samples of rows of time and the other fields. The stamps are the arrivals."""
    columns = list(zip(*rows))
    return kind(*(np.array(column, dtype=object if isinstance(column[0], str) else float)
                  for column in columns[:1] + columns)) if rows else kind.none()


def _printed(observation: Observation, text: str, lines: int) -> None:
    """Add an output of `lines` lines to the present run, and to the present stimulus."""
    for each in observation.runs[-1:]:
        each.printed += text
    for stimulus in observation.stimuli[-1:]:
        if math.isnan(stimulus.end):
            stimulus.printed = (stimulus.printed + text)[-MOST_PRINTED:]
            stimulus.lines += lines


def _add_event(observation: Observation, kind: str, at: float, facts: Dict[str, Any]) -> None:
    """Add an event of a trial to its Observation."""
    if kind in ('trial', 'program'):
        vars(observation).update(facts)
    elif kind == 'begin':
        observation.stimuli.append(Stimulus(begin=at, **facts))
    elif kind == 'end':
        vars(observation.stimuli[-1]).update(facts, end=at)
    elif kind == 'part':
        observation.parts.append((facts['name'], at))
    elif kind == 'start':
        observation.runs.append(Run(at, **facts))
    elif kind == 'ready':
        observation.runs[-1].ready = at
    elif kind == 'run':
        vars(observation.runs[-1]).update(facts)
    elif kind == 'stop':
        observation.runs[-1].end = at
    elif kind == 'unprinted':
        _printed(observation, f"\n... {facts['characters']} characters are left out here ...\n",
                 facts['lines'])
    elif kind == 'odd':
        observation.omitted[NOT_FINITE] = observation.omitted.get(NOT_FINITE, 0) + 1
        observation.not_finite.append([at, facts['text']])
    elif kind == 'left out':
        observation.omitted[facts['what']] = facts['number']
    elif kind == 'own move':
        observation.own_moves.append([at - facts['seconds'], at])
    elif kind == 'not offered':
        observation.missing.update(dict.fromkeys(facts['names'], facts['reason']))
    elif kind == 'call' and 'pose' in facts:
        observation.calls.append([at, facts['pose'], facts['problem']])
    elif kind == 'mouse client':
        observation.mouse_up = facts['up']
    elif kind == 'broken':
        observation.marker_error = facts['text']
    elif kind in SENTENCES:
        known = getattr(observation, SENTENCES[kind])
        if facts['text'] not in known and len(known) < MOST_FINDINGS:
            known.append(facts['text'])
