"""Reads an Observation from the bag of a trial. ros_recording.py writes such bags."""
import json
import math
import re
from dataclasses import replace
from typing import Any, Dict, Sequence

import numpy as np

from tb3_labs.marking.trial.observation import (
    GOAL_POSE, MAX_FINDINGS, NOT_FINITE, REQUESTED_DEG, NodeProcess, Observation, Stimulus)
from tb3_labs.recording.bag_reader import CLOCK_JUMPED
from tb3_labs.recording.ros_bag import read_run
from tb3_labs.recording.run_data import Numbers, Poses, RunData, Texts

SAME_RESET_TIME = 1.0   # A node prints its line about a reset within this time [s] of the call.
#: An Observation keeps this many characters from the start of a process's output, and as many from
#: the end.
MAX_OUTPUT_LENGTH = 20000
COLOUR_CODE = re.compile(r'\x1b\[[\d;]*m')      # changes the colour of the text in a terminal
#: {key of a fact: field of NodeProcess or Observation}, if the field has another name than the key.
#: The keys cannot change, because old bags contain them.
FIELD_OF_KEY = {
    'unheard': 'silent_topics', 'needed': 'needed_topic', 'listens': 'subscribed_topics',
    'publishes': 'published_topics', 'unconnected': 'unconnected_topics', 'up': 'mouse_y_sign'}


def read_trial(path: Any, path_prefixes: Sequence[str] = ()) -> Observation:
    """Returns the Observation in the bag of a trial, as :func:`trial_of` does."""
    return trial_of(read_run(str(path)), path_prefixes)


def trial_of(recording: RunData, path_prefixes: Sequence[str] = ()) -> Observation:
    """Returns the Observation of a recorded trial. The `path_prefixes` are paths on the marking
    machine, which are removed from all texts. Raises ``ValueError`` if no trial was recorded, or if
    the machine's clock jumped during the trial."""
    def without_prefixes(text: str) -> str:
        for prefix in path_prefixes:
            text = text.replace(prefix, '')
        return text
    if any(CLOCK_JUMPED in note for note in recording.notes):
        raise ValueError(f'{CLOCK_JUMPED}; type the same command again')
    log_texts = np.array(list(map(without_prefixes, recording.log.text)), dtype=object)
    recording = replace(recording, log=replace(recording.log, text=log_texts))
    observation = Observation('', '', recording)
    outputs = [(time, {'kind': 'output', 'text': text})
               for time, text in zip(recording.printed.arrival, recording.printed.text)]
    events = [(time, json.loads(without_prefixes(text)))
              for time, text in zip(recording.events.arrival, recording.events.text)]
    for time, event in sorted(outputs + events, key=lambda entry: entry[0]):
        kind = event.pop('kind')
        _add_event(observation, kind, float(time), event)
    if not observation.lab:
        raise ValueError('the recording has no trial')

    observation.stimuli = [stimulus for stimulus in observation.stimuli
                           if not math.isnan(stimulus.end)]
    for printer in observation.processes + observation.stimuli:
        printer.printed = COLOUR_CODE.sub('', without_prefixes(printer.printed))
    for process in observation.processes:
        text = process.printed
        if len(text) > 2 * MAX_OUTPUT_LENGTH:
            process.printed = f'{text[:MAX_OUTPUT_LENGTH]}\n...\n{text[-MAX_OUTPUT_LENGTH:]}'
    observation.recording = with_stimuli(recording, observation)
    return observation


def with_stimuli(recording: RunData, observation: Observation) -> RunData:
    """Returns the recording of a trial with what the marker did: its starts of the node, its
    stimuli, and the letters, goals and resets that it gave to the node."""
    stimuli = observation.stimuli
    names = [[stimulus.begin, stimulus.name] for stimulus in stimuli]
    goals = [[stimulus.begin, *stimulus.facts[GOAL_POSE]] for stimulus in stimuli
             if GOAL_POSE in stimulus.facts]
    letters = []
    for stimulus in stimuli:
        if REQUESTED_DEG in stimulus.facts:
            letters.append([stimulus.begin, np.sign(stimulus.facts[REQUESTED_DEG])])
            letters.append([stimulus.end, 0.0])
    starts = [process.begin for process in observation.processes]
    has_known_frame = _has_known_frame(recording, observation.reset_calls, starts)
    return replace(
        recording, variables=recording.variables.take(has_known_frame),
        resets=Poses.without_stamps(_resets(recording, observation.reset_calls)),
        starts=tuple(starts), states=Texts.without_stamps(names),
        goals=Poses.without_stamps(goals), letters=Numbers.without_stamps(letters))


def _resets(recording, reset_calls):
    """Returns [time, x, y, yaw] of each reset. A reset has the time at which the node printed its
    line about the reset. If the node printed no line, the reset has the time of the call."""
    printed = recording.resets
    resets = np.column_stack([printed.arrival, printed.x, printed.y, printed.yaw]).tolist()
    for time, pose, problem in reset_calls:
        time_to_nearest_line = np.abs(printed.arrival - time).min(initial=math.inf)
        if not problem and time_to_nearest_line >= SAME_RESET_TIME:
            resets.append([time, *pose])
    return sorted(resets)


def _has_known_frame(recording, reset_calls, starts):
    """Returns an array with False for the samples of variables whose frame is unknown. After a
    failed call of the reset, the node's frame is unknown until the next start of the node."""
    time = recording.variables.arrival
    is_known = np.ones(len(time), bool)
    for call_time, _, problem in reset_calls:
        if problem:
            next_start = min([start for start in starts if start > call_time], default=math.inf)
            is_known[(time >= call_time) & (time <= next_start)] = False
    return is_known


def _add_output(observation: Observation, text: str, line_count: int) -> None:
    if observation.processes:
        observation.processes[-1].printed += text
    if observation.stimuli and math.isnan(observation.stimuli[-1].end):
        stimulus = observation.stimuli[-1]
        stimulus.printed = (stimulus.printed + text)[-MAX_OUTPUT_LENGTH:]
        stimulus.line_count += line_count


def _keyed_by_field(facts):
    return {FIELD_OF_KEY.get(key, key): fact for key, fact in facts.items()}


def _add_event(observation: Observation, kind: str, time: float, facts: Dict[str, Any]) -> None:
    if kind in ('trial', 'program', 'mouse client'):
        vars(observation).update(_keyed_by_field(facts))
    elif kind == 'begin':
        observation.stimuli.append(Stimulus(begin=time, **facts))
    elif kind == 'end':
        vars(observation.stimuli[-1]).update(facts, end=time)
    elif kind == 'part':
        observation.parts.append((facts['name'], time))
    elif kind == 'start':
        observation.processes.append(NodeProcess(time, **_keyed_by_field(facts)))
    elif kind == 'ready':
        observation.processes[-1].ready = time
    elif kind == 'run':
        vars(observation.processes[-1]).update(_keyed_by_field(facts))
    elif kind == 'stop':
        observation.processes[-1].end = time
    elif kind == 'output':
        _add_output(observation, facts['text'], facts['text'].count('\n'))
    elif kind == 'unprinted':
        _add_output(observation, f"\n... {facts['characters']} characters are left out here ...\n",
                    facts['lines'])
    elif kind == 'odd':
        observation.not_finite.append([time, facts['text']])
        observation.omitted_counts[NOT_FINITE] = len(observation.not_finite)
    elif kind == 'left out':
        observation.omitted_counts[facts['what']] = facts['number']
    elif kind == 'own move':
        observation.marker_moves.append([time - facts['seconds'], time])
    elif kind == 'not offered':
        observation.not_offered.update(dict.fromkeys(facts['names'], facts['reason']))
    elif kind == 'call' and 'pose' in facts:
        observation.reset_calls.append([time, facts['pose'], facts['problem']])
    elif kind == 'broken':
        observation.marker_error = facts['text']
    elif kind in ('remark', 'finding'):
        sentences = observation.remarks if kind == 'remark' else observation.findings
        if facts['text'] not in sentences and len(sentences) < MAX_FINDINGS:
            sentences.append(facts['text'])
