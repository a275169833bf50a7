"""Sentences on a node that did not do its task, from its observation alone.

A sentence names the first of these that explains it: an exception since the node's start; commands
that are not numbers; a topic that nobody hears, or of another type; no command at all, or zeros.
"""
import re
from collections import defaultdict
from typing import Dict, List

import numpy as np

from tb3_labs.handout import CMD_VEL
from tb3_labs.marking.trial.observation import Observation, Run, Scene
from tb3_labs.marking.trial.tracebacks import counted, exceptions, last_line
from tb3_labs.watch.broken_link import wrong_field

#: The type of cmd_vel.
TWIST = 'geometry_msgs/Twist'
#: A node gets up to three Ctrl+C, since rospy may lose a node's last message.
CTRL_C = ('Ctrl+C', 'Ctrl+C again', 'Ctrl+C a third time')
#: Without a command a robot turns by less than this [deg].
STILL_DEG = 3.0
#: These words, and then the exception.
STOPPED = 'an exception had stopped it'
#: The exception that a remark quotes.
QUOTED = re.compile(r'^A traceback was printed .*?: ([\'"].*[\'"])\. The clean exit')

UNDEFINED = re.compile(r"name '\w+' is not defined")


def remarks_on(observation: Observation) -> List[str]:
    """The sentences for the student that belong to no criterion."""
    deaf = [f'Note that {observation.deaf}.'] if observation.deaf else []
    return observation.remarks + deaf + tracebacks_before_the_end(observation) + observation.gaps


def faults_in(observation: Observation, verdict_text: str) -> List[str]:
    """The faults that its text shows, without an undefined name that the verdicts (`verdict_text`)
    name."""
    return [fault for fault in observation.faults if not any(
        name in verdict_text for name in UNDEFINED.findall(fault))]


def tracebacks_before_the_end(observation: Observation) -> List[str]:
    """A sentence on each exception before Ctrl+C: no criterion is about it."""
    names: Dict[str, List[str]] = defaultdict(list)
    for stimulus in observation.stimuli:
        if stimulus.name not in CTRL_C:
            for error in exceptions(stimulus.printed, observation.file):
                names[error].append(stimulus.name)
    return ['A traceback was printed during "{}"{}{}. The clean exit is about Ctrl+C alone.'.format(
        each[0], ', {} times in all'.format(len(each)) if len(each) > 1 else '',
        error and ': {!r}'.format(error)) for error, each in names.items()]


def without_quoted(remarks: List[str], verdict_text: str) -> List[str]:
    """The remarks, without the exceptions that the verdicts' sentences (`verdict_text`) quote."""
    return [remark for remark in remarks if not any(
        error in verdict_text for error in QUOTED.findall(remark))]


def errors_in(observation: Observation, run: Run) -> List[str]:
    """The exceptions of a run before it got Ctrl+C, without those that cannot be read."""
    text = run.printed
    for stimulus in observation.stimuli:
        if stimulus.name in CTRL_C and stimulus.begin >= run.begin:
            text = text.replace(stimulus.printed, '')
    return list(filter(None, exceptions(text, observation.file)))


def idle(scene: Scene) -> str:
    """A clause on the reason why a node did not move the robot in this scene."""
    run = scene.run
    errors = errors_in(scene.observed, run)
    if errors:
        number = sum(errors_in(scene.observed, each).count(errors[0])
                     for each in scene.observed.runs)
        return f'{STOPPED}, {counted(errors[:1] * number)[0]}'
    if scene.odd:
        return f'{len(scene.odd)} of its commands were not finite numbers, such as {scene.odd[0]}'
    if len(scene.moving):
        return f'its last command on {CMD_VEL} was zero'
    if len(scene.commands):
        number = len(scene.commands)
        if other_fields(scene):
            return f'{other_fields(scene)} in its commands on {CMD_VEL}'
        return f'one command came on {CMD_VEL}, a zero' if number == 1 else \
            f'{number} commands came on {CMD_VEL}, all of them zero'
    return _silence(scene, run) + _printed(scene)


def other_fields(scene: Scene) -> str:
    """A clause on a field of the scene's commands that no wheel follows; '' if there is none."""
    if scene.observed.run is None:
        return ''
    sent = scene.observed.run.commands
    return wrong_field(sent.take((sent.arrival >= scene.begin) & (sent.arrival <= scene.end)))


def _silence(scene, run):
    kind = run.publishes.get('/' + CMD_VEL)
    if kind not in (None, TWIST):
        return f'it publishes {CMD_VEL} as {kind}, and the robot takes {TWIST} alone'
    if other_topics(run, CMD_VEL):
        return other_topics(run, CMD_VEL)
    whole = np.array([time for time, _, _ in scene.observed.commands if run.begin <= time and (
        run.end is None or time <= run.end)])
    if len(whole) > 2:      # else no rate is known
        return 'nothing came on {} for {:.1f} s (in this run a command every {:.2g} s)'.format(
            CMD_VEL, scene.end - scene.begin, float(np.median(np.diff(whole))))
    return f'nothing came on {CMD_VEL}'


def other_topics(run: Run, topic: str) -> str:
    """A clause on the topics that a node publishes; '' if it has `topic`, or none is known."""
    return '' if not run.publishes or '/' + topic in run.publishes else \
        f"it does not publish {topic}, but {' and '.join(sorted(run.publishes))}"


def _printed(scene):
    printed = re.sub(r'^\w\r?\n', '', scene.printed)   # a terminal shows what was typed
    return f", and it printed {last_line(printed) if printed.strip() else 'nothing'}"


def unprinted(scene: Scene) -> str:
    """A clause on the reason why a node did not print its line in this scene."""
    run = scene.run
    errors = errors_in(scene.observed, run)
    if errors:
        return f'its callback failed: {counted(errors)[0]}'
    if run.unconnected:
        return 'no message of {} reached it: does its type agree with that of the topic?'.format(
            ' and '.join(run.unconnected))
    if scene.printed.strip():
        return f'it printed {last_line(scene.printed)}'
    return 'it printed nothing'
