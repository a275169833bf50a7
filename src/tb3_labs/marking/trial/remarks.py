"""Sentences on a node that did not do its task, from its observation alone.

A sentence names the first of these that explains it: an exception since the node's start; commands
that are not numbers; a topic that nobody hears, or of another type; no command at all, or zeros.
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
#: Without a command a robot turns by less than this [deg].
STILL_DEG = 3.0
#: These words, and then the exception.
STOPPED = 'an exception had stopped it'
#: An undefined name, as Python's exception and the fault of a text name it.
UNDEFINED = re.compile(r"name '\w+' is not defined")

#: A traceback begins with these words, also in the middle of a line of a log.
TRACEBACK = 'Traceback (most recent call last)'
ERROR = re.compile(r'\w[\w.]*(Error|Exception|Interrupt|Exit)\b')
FRAME = re.compile(r'^ *File "(.*)", line (\d+)(?:, in (\S+))?', re.MULTILINE)
#: Python prints this between the cause of an exception and that exception.
CHAINED = re.compile('^(During handling of|The above exception was)', re.MULTILINE)
#: Python reports a file that it cannot read without a traceback.
UNREAD = re.compile(r'(?=^ *File ".*", line \d+\n(?:.*\n){1,3}(?:Syntax|Indentation|Tab)Error:)',
                    re.MULTILINE)
#: rospy itself raises these in a callback that publishes while the node ends.
NOT_THEIRS, NOR_THIS = 'publish() to a closed topic', 'topic was closed during publish()'
#: The most characters of an exception, and of a line, that are quoted.
LONGEST_ERROR, LONGEST_LINE = 160, 160


def remarks_on(observation: Observation, verdict_text: str = '') -> List[str]:
    """The sentences for the student that belong to no criterion, without the exceptions that the
    verdicts (`verdict_text`) quote."""
    deaf = [f'Note that {observation.deaf}.'] if observation.deaf else []
    lost = [f'{number} {what} came on {CMD_VEL}: they are not recorded, and not judged.'
            for what, number in sorted(observation.lost.items())]
    return observation.remarks + deaf + tracebacks_before_the_end(observation, verdict_text) + lost


def faults_in(observation: Observation, verdict_text: str) -> List[str]:
    """The faults that its text shows, without an undefined name that the verdicts (`verdict_text`)
    name."""
    return [fault for fault in observation.faults if not any(
        name in verdict_text for name in UNDEFINED.findall(fault))]


def tracebacks_before_the_end(observation: Observation, verdict_text: str = '') -> List[str]:
    """A sentence on each exception before Ctrl+C that the verdicts do not quote."""
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
    sent = scene.observed.run.commands
    return wrong_field(sent.take((sent.arrival >= scene.begin) & (sent.arrival <= scene.end)))


def _silence(scene, run):
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
        return (f"no message of {' and '.join(run.unconnected)} reached it: does its type agree "
                'with that of the topic?')
    if scene.printed.strip():
        return f'it printed {last_line(scene.printed)}'
    return 'it printed nothing'


# -- what a node did not do at all

def reason_of(problem: NotObserved, observation: Observation) -> str:
    """The clause of a NotObserved."""
    if isinstance(problem, Ended):
        return 'it ended in the middle of this: ' + last_words(str(problem), observation.file)
    return why_missing(observation) if isinstance(problem, NotTried) else str(problem)


def why_missing(observation: Observation) -> str:
    """Why a stimulus is missing: the node ended, was never ready, or the time was over."""
    if not observation.runs:
        return 'it was never started'
    run = observation.runs[-1]
    if run.ended_by_itself:
        ending = 'its main program was over, and nothing kept the node running' if (
            run.status == 0 and not exceptions(run.printed)) else last_words(
                run.printed, observation.file)
        return f"it {'ended at once' if run.ready is None else 'had ended'}: {ending}"
    if run.ready is None:
        return ': '.join(filter(None, [_never_ready(run), observation.deaf]))
    return 'the time was up before this was tried' if run.end is None else 'this was not tried'


def _never_ready(run):
    """A clause on a run that did not listen to the topic that it needs."""
    if run.needed and not run.nodes:
        return 'it ran, but never came to rospy.init_node()'
    if '/' + run.needed in run.listens:
        return f'it was not ready in time, though it listened to {run.needed}'
    others = ' and '.join(topic for topic in run.listens if topic not in run.unheard)
    never = f"it ran, but never listened to {run.needed or 'the robot'}"
    return f'{never}; it listened to {others}' if others else never


# -- the text that a node printed: its exceptions, and its last words

def exceptions(printed: str, file: str = '') -> List[str]:
    """The exceptions in the text, in their order: each with its line in `file`, the node's, if it
    is known, and '' for one that cannot be read. rospy's own are left out.

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
            continue        # the next exception ended it
        if not any(words in (error or piece) for words in (NOT_THEIRS, NOR_THIS)):
            found.append(error[:LONGEST_ERROR] + _place(piece, file) if error else '')
    return found


def _place(piece, file):
    frames = FRAME.findall(piece)
    own = [frame for frame in frames if file and frame[0].rsplit('/', 1)[-1] == file] or [
        frame for frame in frames if not frame[0].startswith(('/usr/', '/opt/', '<frozen'))]
    if not own:
        return ' (was a callback given as self.f(), not as self.f?)' if (
            "'NoneType' object is not callable" in piece) else ''    # rospy calls what it was given
    _, line, function = own[-1]
    return f" (line {line}{', in ' + function if function.isidentifier() else ''})"


def exceptions_in(scene: Scene) -> List[str]:
    """The exceptions that the node printed in a scene; see `exceptions`."""
    return exceptions(scene.printed, scene.observed.file)


def counted(errors: List[str]) -> List[str]:
    """Each exception once, in quotes, with its number if there are several of it."""
    return [repr(error) if number == 1 else f'{error!r}, {number} times'
            for error, number in Counter(errors).items()]


def last_line(printed: str) -> str:
    """The last line that a node printed, in quotes, or a clause if there is none."""
    lines = list(filter(None, map(str.strip, printed.splitlines())))
    return repr(lines[-1][:LONGEST_LINE]) if lines else 'it printed nothing'


def last_words(printed: str, file: str) -> str:
    """The last exception in the text, else its last line; see `exceptions`."""
    errors = exceptions(printed, file)
    return counted(errors[-1:])[0] if errors else last_line(printed)
