"""Reads an Observation from the bag of a trial. ros_recording.py writes such bags."""
import json
import math
import re
from dataclasses import replace
from typing import Any, Dict, Sequence, Type

import numpy as np

from tb3_labs.marking.trial.observation import (
    GOAL_POSE, MAX_FINDINGS, NOT_FINITE, REQUESTED_DEG, NodeProcess, Observation, Stimulus)
from tb3_labs.recording.bag_reader import CLOCK_JUMPED
from tb3_labs.recording.ros_bag import read_run
from tb3_labs.recording.run_data import Numbers, Poses, RunData, SamplesType, States

SAME_RESET_TIME = 1.0       # [s] between a call of the reset and the node's line about this reset
#: An Observation keeps this many characters from the start of a process's output, and as many
#: characters from its end.
MAX_OUTPUT_LENGTH = 20000
COLOUR_CODE = re.compile(r'\x1b\[[\d;]*m')      # of a terminal
#: {kind of event: an attribute of Observation}
SENTENCE_LISTS = {'remark': 'remarks', 'finding': 'findings'}
#: {key of a fact: field of NodeProcess} for the keys that are not the field's name. The keys cannot
#: change, because old bags have the same keys.
PROCESS_FIELDS = {'unheard': 'silent_topics', 'needed': 'needed_topic', 'listens': 'subscribed',
                  'publishes': 'published'}


def read_trial(path: Any, path_prefixes: Sequence[str] = ()) -> Observation:
    """Returns the Observation in the bag of a trial. The `path_prefixes`, which are paths on the
    marking machine, are removed from all texts. Raises ``ValueError`` if the bag has no trial, or
    if the machine's clock jumped during the trial."""
    def cleaned(text: str) -> str:
        for prefix in path_prefixes:
            text = text.replace(prefix, '')
        return text
    recording = read_run(str(path))
    if any(CLOCK_JUMPED in note for note in recording.notes):
        raise ValueError(f'{CLOCK_JUMPED}; type the same command again')
    log_texts = np.array(list(map(cleaned, recording.log.text)), dtype=object)
    recording = replace(recording, log=replace(recording.log, text=log_texts))
    observation = Observation('', '', recording)
    outputs = [(at, {'kind': 'output', 'text': text})
               for at, text in zip(recording.printed.arrival, recording.printed.text)]
    events = [(at, json.loads(cleaned(text)))
              for at, text in zip(recording.events.arrival, recording.events.text)]
    for at, event in sorted(outputs + events, key=lambda entry: entry[0]):
        _add_event(observation, event.pop('kind'), float(at), event)
    if not observation.lab:
        raise ValueError('the recording has no trial')
    observation.stimuli = [stimulus for stimulus in observation.stimuli
                           if not math.isnan(stimulus.end)]
    for printer in observation.processes + observation.stimuli:
        printer.printed = COLOUR_CODE.sub('', cleaned(printer.printed))
    for process in observation.processes:
        text = process.printed
        if len(text) > 2 * MAX_OUTPUT_LENGTH:
            process.printed = f'{text[:MAX_OUTPUT_LENGTH]}\n...\n{text[-MAX_OUTPUT_LENGTH:]}'
    observation.recording = with_stimuli(recording, observation)
    return observation


def with_stimuli(recording: RunData, observation: Observation) -> RunData:
    """Adds the marker's starts, stimuli, letters, goals and resets to the recording of a trial, and
    returns the new recording. A reset has the time at which the node printed its line about the
    reset. If the node printed no line, the reset has the time of the call.

    After a failed call of the reset the node's frame is unknown. Therefore the samples of variables
    between the failed call and the next start of the node are removed.
    """
    printed = recording.resets
    is_known = np.ones(len(recording.variables), bool)
    resets = np.column_stack([printed.arrival, printed.x, printed.y, printed.yaw]).tolist()
    for at, pose, problem in observation.calls:
        if problem:
            later_starts = [
                process.begin for process in observation.processes if process.begin > at]
            next_start = min(later_starts, default=math.inf)
            arrival = recording.variables.arrival
            is_known &= (arrival < at) | (arrival > next_start)
        elif not (np.abs(printed.arrival - at) < SAME_RESET_TIME).any():
            resets.append([at, *pose])
    goals, letters = [], []
    for stimulus in observation.stimuli:
        if GOAL_POSE in stimulus.facts:
            goals.append([stimulus.begin, *stimulus.facts[GOAL_POSE]])
        if REQUESTED_DEG in stimulus.facts:
            letters.append([stimulus.begin, np.sign(stimulus.facts[REQUESTED_DEG])])
            letters.append([stimulus.end, 0.0])
    names = [[stimulus.begin, stimulus.name] for stimulus in observation.stimuli]
    return replace(
        recording, variables=recording.variables.take(is_known),
        resets=samples_from_rows(Poses, sorted(resets)),
        starts=tuple(process.begin for process in observation.processes),
        states=samples_from_rows(States, names), goals=samples_from_rows(Poses, goals),
        letters=samples_from_rows(Numbers, letters))


def samples_from_rows(kind: Type[SamplesType], rows: Sequence[Sequence[Any]]) -> SamplesType:
    """Returns Samples of the class `kind`. A row has the time of arrival, which is also the stamp,
    then the fields."""
    return kind.from_rows([(row[0], *row) for row in rows])


def _add_output(observation: Observation, text: str, lines: int) -> None:
    if observation.processes:
        observation.processes[-1].printed += text
    if observation.stimuli and math.isnan(observation.stimuli[-1].end):
        stimulus = observation.stimuli[-1]
        stimulus.printed = (stimulus.printed + text)[-MAX_OUTPUT_LENGTH:]
        stimulus.line_count += lines


def _process_fields(facts):
    return {PROCESS_FIELDS.get(key, key): fact for key, fact in facts.items()}


def _add_event(observation: Observation, kind: str, at: float, facts: Dict[str, Any]) -> None:
    if kind in ('trial', 'program'):
        vars(observation).update(facts)
    elif kind == 'begin':
        observation.stimuli.append(Stimulus(begin=at, **facts))
    elif kind == 'end':
        vars(observation.stimuli[-1]).update(facts, end=at)
    elif kind == 'part':
        observation.parts.append((facts['name'], at))
    elif kind == 'start':
        observation.processes.append(NodeProcess(at, **_process_fields(facts)))
    elif kind == 'ready':
        observation.processes[-1].ready = at
    elif kind == 'run':
        vars(observation.processes[-1]).update(_process_fields(facts))
    elif kind == 'stop':
        observation.processes[-1].end = at
    elif kind == 'output':
        _add_output(observation, facts['text'], facts['text'].count('\n'))
    elif kind == 'unprinted':
        _add_output(observation, f"\n... {facts['characters']} characters are left out here ...\n",
                    facts['lines'])
    elif kind == 'odd':
        observation.not_finite.append([at, facts['text']])
        observation.omitted_counts[NOT_FINITE] = len(observation.not_finite)
    elif kind == 'left out':
        observation.omitted_counts[facts['what']] = facts['number']
    elif kind == 'own move':
        observation.marker_moves.append([at - facts['seconds'], at])
    elif kind == 'not offered':
        observation.not_offered.update(dict.fromkeys(facts['names'], facts['reason']))
    elif kind == 'call' and 'pose' in facts:
        observation.calls.append([at, facts['pose'], facts['problem']])
    elif kind == 'mouse client':
        observation.mouse_y_sign = facts['up']
    elif kind == 'broken':
        observation.marker_error = facts['text']
    elif kind in SENTENCE_LISTS:
        sentences = getattr(observation, SENTENCE_LISTS[kind])
        if facts['text'] not in sentences and len(sentences) < MAX_FINDINGS:
            sentences.append(facts['text'])
