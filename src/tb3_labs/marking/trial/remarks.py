"""Sentences on a node that did not do its task, from its Observation alone.

A sentence names the first cause of this list that applies: an exception since the node's start;
commands that are not numbers; a topic of another name or type; zeros; no command at all.
"""
import math
import re
from collections import Counter, defaultdict
from typing import Dict, List

import numpy as np

from tb3_labs.handout import CMD_VEL
from tb3_labs.marking.trial.observation import (
    CTRL_C, Ended, NotObserved, NotTried, Observation, Run, Scene)
from tb3_labs.watch.broken_link import wrong_field

#: The type of cmd_vel.
TWIST = 'geometry_msgs/Twist'
#: A robot without a command turns by less than this [deg].
STILL_DEG = 3.0
#: A clause begins with these words, if an exception follows.
STOPPED_BY = 'an exception had stopped it'
#: The words on an undefined name, both in Python's exception and in the fault of a text.
UNDEFINED = re.compile(r"name '\w+' is not defined")

#: A traceback begins with these words. They may stand in the middle of a line of a log.
TRACEBACK = 'Traceback (most recent call last)'
ERROR = re.compile(r'\w[\w.]*(Error|Exception|Interrupt|Exit)\b')
FRAME = re.compile(r'^ *File "(.*)", line (\d+)(?:, in (\S+))?', re.MULTILINE)
#: Python prints this between the cause of an exception and that exception.
CHAINED = re.compile('^(During handling of|The above exception was)', re.MULTILINE)
#: Python prints this, without a traceback, for a file that is not valid Python.
UNREAD = re.compile(r'(?=^ *File ".*", line \d+\n(?:.*\n){1,3}(?:Syntax|Indentation|Tab)Error:)',
                    re.MULTILINE)
#: rospy itself raises these in a callback that publishes while the node ends.
NOT_THEIRS, NOR_THIS = 'publish() to a closed topic', 'topic was closed during publish()'
#: The most characters of an exception, and of a line, that are quoted.
LONGEST_ERROR, LONGEST_LINE = 160, 160


def remarks_on(observation: Observation, verdict_text: str = '') -> List[str]:
    """Returns the sentences for the student that belong to no criterion, without the exceptions
    that `verdict_text` quotes, the text of the verdicts."""
    remarks = list(observation.remarks)
    if observation.unpublished_topic:
        remarks.append(f'Note that {observation.unpublished_topic}.')
    remarks += tracebacks_before_the_end(observation, verdict_text)
    return remarks + [
        f'{number} {what} came on {CMD_VEL}: they are not recorded, and not judged.'
        for what, number in sorted(observation.omitted.items())]


def faults_in(observation: Observation, verdict_text: str) -> List[str]:
    """Returns the faults in the text of its file, without the undefined names that `verdict_text`
    has, the text of the verdicts."""
    return [fault for fault in observation.faults if not any(
        name in verdict_text for name in UNDEFINED.findall(fault))]


def tracebacks_before_the_end(observation: Observation, verdict_text: str = '') -> List[str]:
    """Returns a sentence on each exception before Ctrl+C that `verdict_text` does not quote."""
    names: Dict[str, List[str]] = defaultdict(list)
    for stimulus in observation.stimuli:
        if stimulus.name not in CTRL_C:
            for error in exceptions(stimulus.printed, observation.file):
                names[error].append(stimulus.name)
    return ['A traceback was printed during "{}"{}{}. The clean exit is about Ctrl+C alone.'.format(
        each[0], ', {} times in all'.format(len(each)) if len(each) > 1 else '',
        error and f': {error!r}') for error, each in names.items()
        if not error or repr(error) not in verdict_text]


def errors_in(observation: Observation, run: Run) -> List[str]:
    """Returns the readable exceptions of a run before its Ctrl+C."""
    text = run.printed
    for stimulus in observation.stimuli:
        if stimulus.name in CTRL_C and stimulus.begin >= run.begin:
            text = text.replace(stimulus.printed, '')
    return list(filter(None, exceptions(text, observation.file)))


def why_idle(scene: Scene) -> str:
    """Returns a clause: why did the node not move the robot in this scene?"""
    run = scene.run
    errors = errors_in(scene.observed, run)
    if errors:
        number = sum(errors_in(scene.observed, each).count(errors[0])
                     for each in scene.observed.runs)
        return f'{STOPPED_BY}, {quoted_errors(errors[:1] * number)[0]}'
    if scene.not_finite:
        return '{} of its commands were not finite numbers, such as {}'.format(
            len(scene.not_finite), scene.not_finite[0])
    if len(scene.moving):
        return f'its last command on {CMD_VEL} was zero'
    if len(scene.commands):
        number = len(scene.commands)
        if other_fields(scene):
            return f'{other_fields(scene)} in its commands on {CMD_VEL}'
        return f'one command came on {CMD_VEL}, a zero' if number == 1 else \
            f'{number} commands came on {CMD_VEL}, all of them zero'
    return _why_no_command(scene, run) + _printed_text(scene)


def other_fields(scene: Scene) -> str:
    """Returns a clause on a field of the scene's commands that no wheel follows, such as linear.y;
    '' if there is none."""
    sent = scene.observed.run.commands
    return wrong_field(sent.take((sent.arrival >= scene.begin) & (sent.arrival <= scene.end)))


def _why_no_command(scene, run):
    kind = run.publishes.get('/' + CMD_VEL)
    if kind not in (None, TWIST):
        return f'it publishes {CMD_VEL} as {kind}, and the robot takes {TWIST} alone'
    if other_topics(run, CMD_VEL):
        return other_topics(run, CMD_VEL)
    times = scene.observed.run.commands.arrival
    times = times[(times >= run.begin) & (times <= (math.inf if run.end is None else run.end))]
    nothing = f'nothing came on {CMD_VEL}'
    if len(times) <= 2:      # no rate is known
        return nothing
    return (f'{nothing} for {scene.end - scene.begin:.1f} s (in this run a command every '
            f'{np.median(np.diff(times)):.2g} s)')


def other_topics(run: Run, topic: str) -> str:
    """Returns a clause on the topics that a node publishes in place of `topic`; '' if it publishes
    `topic`, or if its topics are unknown."""
    return '' if not run.publishes or '/' + topic in run.publishes else \
        f"it does not publish {topic}, but {' and '.join(sorted(run.publishes))}"


def _printed_text(scene):
    printed = re.sub(r'^\w\r?\n', '', scene.printed)   # a terminal shows what was typed
    return f", and it printed {last_line(printed) if printed.strip() else 'nothing'}"


def why_unprinted(scene: Scene) -> str:
    """Returns a clause: why did the node not print its line in this scene?"""
    run = scene.run
    errors = errors_in(scene.observed, run)
    if errors:
        return f'its callback failed: {quoted_errors(errors)[0]}'
    if run.unconnected:
        return (f"no message of {' and '.join(run.unconnected)} reached it: does its type agree "
                'with that of the topic?')
    if scene.printed.strip():
        return f'it printed {last_line(scene.printed)}'
    return 'it printed nothing'


# -- a criterion that could not be judged

def reason_of(problem: NotObserved, observation: Observation) -> str:
    """Returns a clause on the reason of a NotObserved."""
    if isinstance(problem, Ended):
        return 'it ended in the middle of this: ' + last_words(str(problem), observation.file)
    return why_missing(observation) if isinstance(problem, NotTried) else str(problem)


def why_missing(observation: Observation) -> str:
    """Returns a clause on the reason why a stimulus was not tried: the node had ended, was never
    ready, or the time was up."""
    if not observation.runs:
        return 'it was never started'
    run = observation.runs[-1]
    if run.ended_by_itself:
        ending = 'its main program was over, and nothing kept the node running' if (
            run.status == 0 and not exceptions(run.printed)) else last_words(
                run.printed, observation.file)
        return f"it {'ended at once' if run.ready is None else 'had ended'}: {ending}"
    if run.ready is None:
        return ': '.join(filter(None, [_never_ready(run), observation.unpublished_topic]))
    return 'the time was up before this was tried' if run.end is None else 'this was not tried'


def _never_ready(run):
    """Returns a clause on a run that did not subscribe to the topic that it needs."""
    if run.needed and not run.nodes:
        return 'it ran, but never came to rospy.init_node()'
    if '/' + run.needed in run.listens:
        return f'it was not ready in time, though it listened to {run.needed}'
    others = ' and '.join(topic for topic in run.listens if topic not in run.unheard)
    never = f"it ran, but never listened to {run.needed or 'the robot'}"
    return f'{never}; it listened to {others}' if others else never


# -- a node's output: its exceptions, and its last line

def exceptions(printed: str, file: str = '') -> List[str]:
    """Returns the exceptions in a node's output, in their order; '' for an unreadable exception.
    Each has its line in `file`, the node's, if `file` is known. rospy's own are left out.

    For example ``NameError: name 'raw_input' is not defined (line 54, in callback_controller)``.
    """
    found = []
    pieces = printed.split(TRACEBACK)
    if len(pieces) == 1:
        pieces = UNREAD.split(printed)
    for piece in pieces[1:]:
        lines = [line for line in piece.splitlines()[1:] if line.strip()]
        error = next((line for line in lines if ERROR.match(line)), None)
        if CHAINED.search(piece):
            continue        # the next exception is the one that ended the node
        if not any(words in (error or piece) for words in (NOT_THEIRS, NOR_THIS)):
            found.append(error[:LONGEST_ERROR] + _line_of(piece, file) if error else '')
    return found


def _line_of(piece, file):
    """Returns the line and the function of a traceback in brackets, if they are known."""
    frames = FRAME.findall(piece)
    own = [frame for frame in frames if file and frame[0].rsplit('/', 1)[-1] == file] or [
        frame for frame in frames if not frame[0].startswith(('/usr/', '/opt/', '<frozen'))]
    if not own:
        return ' (was a callback given as self.f(), not as self.f?)' if (
            "'NoneType' object is not callable" in piece) else ''    # rospy called the result
    _, line, function = own[-1]
    return f" (line {line}{', in ' + function if function.isidentifier() else ''})"


def exceptions_in(scene: Scene) -> List[str]:
    """Returns the exceptions that the node printed in a scene; see `exceptions`."""
    return exceptions(scene.printed, scene.observed.file)


def quoted_errors(errors: List[str]) -> List[str]:
    """Returns each different exception once, in quotes, and how often it came."""
    return [repr(error) if number == 1 else f'{error!r}, {number} times'
            for error, number in Counter(errors).items()]


def last_line(printed: str) -> str:
    """Returns the last line of a node's output in quotes, or a clause if the output is empty."""
    lines = list(filter(None, map(str.strip, printed.splitlines())))
    return repr(lines[-1][:LONGEST_LINE]) if lines else 'it printed nothing'


def last_words(printed: str, file: str) -> str:
    """Returns the last exception in a node's output, else its last line, in quotes."""
    errors = exceptions(printed, file)
    return quoted_errors(errors[-1:])[0] if errors else last_line(printed)
