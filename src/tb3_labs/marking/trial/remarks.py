"""Tells students in sentences why a node did not do its task."""
import re
from typing import Dict, List

from tb3_labs.handout import CMD_VEL_TOPIC
from tb3_labs.marking.trial.observation import (
    CTRL_C, Ended, NodeProcess, NotObserved, NotTried, Observation, Scene)
from tb3_labs.watch.mistake import nonzero_field_text

TWIST = 'geometry_msgs/Twist'       # the type of cmd_vel
MAX_IDLE_TURN_DEG = 3.0             # A robot without a command turns by less than this angle.
#: A traceback begins with these words, which can stand in the middle of a line of a log.
TRACEBACK = 'Traceback (most recent call last)'
#: The line of a traceback that names the exception.
ERROR_LINE = re.compile(r'\w[\w.]*(Error|Exception|Interrupt|Exit)\b')
#: A line of a traceback that names the path of a file, a line number and a function.
TRACEBACK_FRAME = re.compile(r'^ *File "(.*)", line (\d+)(?:, in (\S+))?', re.MULTILINE)
SYSTEM_FOLDERS = ('/usr/', '/opt/', '<frozen')      # the folders of Python and ROS
#: Python prints these words between two tracebacks if the first exception led to the second.
CAUSE_OF_NEXT = re.compile('^(During handling of|The above exception was)', re.MULTILINE)
#: The place before the lines that Python prints instead of a traceback for an invalid program.
SYNTAX_ERROR = re.compile(
    r'(?=^ *File ".*", line \d+\n(?:.*\n){1,3}(?:Syntax|Indentation|Tab)Error:)', re.MULTILINE)
#: If a callback publishes while the node ends, rospy raises an exception with one of these texts.
CLOSED_TOPIC = 'publish() to a closed topic'
CLOSED_TOPIC_TEXTS = (CLOSED_TOPIC, 'topic was closed during publish()')
#: Errors that may come from the version of Python, or of a module, on this machine.
VERSION_ERROR = re.compile(
    "^(?:AttributeError: module '|AttributeError: 'Thread' object .* 'isAlive'|ImportError: |"
    'ModuleNotFoundError: ).*$', re.MULTILINE)
MAX_QUOTE_LENGTH = 160      # characters of a quoted exception or line


def remarks_on(observation: Observation, verdict_text: str = '') -> List[str]:
    """Returns the sentences for the student that belong to no criterion. `verdict_text` is the text
    of the verdicts. An exception that this text quotes is left out."""
    remarks = list(observation.remarks)
    if observation.clause_on_silent_topics:
        remarks.append(f'Note that {observation.clause_on_silent_topics}.')
    remarks += tracebacks_before_the_end(observation, verdict_text)
    for what, count in sorted(observation.omitted_counts.items()):
        remarks.append(
            f'{count} {what} came on {CMD_VEL_TOPIC}: they are not recorded, and not judged.')
    return remarks


def tracebacks_before_the_end(observation: Observation, verdict_text: str = '') -> List[str]:
    """Returns a sentence on each exception that the node printed before Ctrl+C, unless
    `verdict_text` quotes the exception."""
    first_stimulus: Dict[str, str] = {}     # {quoted exception: the name of a stimulus}
    for stimulus in observation.stimuli:
        if stimulus.name not in CTRL_C:
            for exception in printed_exceptions(stimulus.printed, observation.file):
                first_stimulus.setdefault(repr(exception), stimulus.name)
    return [f'A traceback was printed during "{name}": {quoted}. The clean exit is about Ctrl+C '
            'alone.' for quoted, name in first_stimulus.items() if quoted not in verdict_text]


def version_errors(observation: Observation) -> List[str]:
    """Returns a sentence for the instructor on each printed error that matches VERSION_ERROR."""
    printed = '\n'.join(process.printed for process in observation.processes)
    return [f'It ended with "{line}". On another machine, such as one with Noetic, it may run.'
            for line in dict.fromkeys(VERSION_ERROR.findall(printed))]


def _exceptions_before_ctrl_c(scene):
    """Returns the exceptions that the scene's process printed, except those printed at Ctrl+C."""
    printed = scene.process.printed
    for stimulus in scene.observation.stimuli:
        if stimulus.name in CTRL_C and stimulus.begin >= scene.process.begin:
            printed = printed.replace(stimulus.printed, '')
    return printed_exceptions(printed, scene.observation.file)


def why_idle(scene: Scene) -> str:
    """Returns a clause on the first reason why the node did not move the robot in the scene."""
    exceptions = _exceptions_before_ctrl_c(scene)
    if exceptions:
        return f'an exception had stopped it, {exceptions[0]!r}'
    if scene.not_finite:
        return (f'{len(scene.not_finite)} of its commands were not finite numbers, such as '
                f'{scene.not_finite[0]}')
    if len(scene.moving_commands):
        return f'its last command on {CMD_VEL_TOPIC} was zero'
    other_fields = clause_on_other_fields(scene)
    if other_fields:
        return f'{other_fields} in its commands on {CMD_VEL_TOPIC}'
    if len(scene.commands):
        return f'only zeros came on {CMD_VEL_TOPIC}'
    printed = re.sub(r'^\w\r?\n', '', scene.printed)   # without the letter that the marker typed
    return f'{_why_no_command(scene.process)}, and {_clause_on_output(printed)}'


def clause_on_other_fields(scene: Scene) -> str:
    """Returns a clause on the fields of the commands that move no wheel, such as linear.y. Returns
    '' if these fields are zero."""
    commands = scene.observation.recording.commands
    is_inside = (commands.arrival >= scene.begin) & (commands.arrival <= scene.end)
    return nonzero_field_text(commands.take(is_inside))


def _why_no_command(process):
    type_name = process.published_topics.get('/' + CMD_VEL_TOPIC)
    if type_name not in (None, TWIST):
        return f'it publishes {CMD_VEL_TOPIC} as {type_name}, and the robot takes {TWIST} alone'
    return clause_on_other_topics(process, CMD_VEL_TOPIC) or f'nothing came on {CMD_VEL_TOPIC}'


def clause_on_other_topics(process: NodeProcess, topic: str) -> str:
    """Returns a clause on the topics that a node publishes in place of `topic`. Returns '' if the
    node publishes `topic`, or if the node's topics are unknown."""
    if not process.published_topics or '/' + topic in process.published_topics:
        return ''
    return f"it does not publish {topic}, but {' and '.join(sorted(process.published_topics))}"


def _clause_on_output(printed):
    return f'it printed {last_line(printed)}' if printed.strip() else 'it printed nothing'


def why_unprinted(scene: Scene) -> str:
    """Returns a clause on the reason why the node did not print its line in the scene."""
    exceptions = _exceptions_before_ctrl_c(scene)
    if exceptions:
        return f'its callback failed: {exceptions[0]!r}'
    if not scene.process.unconnected_topics:
        return _clause_on_output(scene.printed)
    topics = ' and '.join(scene.process.unconnected_topics)
    return f'no message of {topics} reached it: does its type agree with that of the topic?'


# -- a criterion that could not be judged

def why_not_judged(problem: NotObserved, observation: Observation) -> str:
    """Returns a clause on the reason why a criterion raised `problem`."""
    if isinstance(problem, Ended):
        return 'it ended in the middle of this: ' + last_exception(str(problem), observation.file)
    if isinstance(problem, NotTried):
        return why_not_tried(observation)
    return str(problem)


def why_not_tried(observation: Observation) -> str:
    """Returns a clause on the reason why a stimulus was not tried, such as the end of the node."""
    if not observation.processes:
        return 'it was never started'
    process = observation.processes[-1]
    was_ready = process.ready is not None
    if process.ended_by_itself:
        ending = last_exception(process.printed, observation.file)
        if process.status == 0 and not printed_exceptions(process.printed):
            ending = 'its main program was over, and nothing kept the node running'
        return f'it had ended: {ending}' if was_ready else f'it ended at once: {ending}'
    if not was_ready:
        clauses = [_why_never_ready(process), observation.clause_on_silent_topics]
        return ': '.join(filter(None, clauses))
    if process.end is None:
        return 'the time was up before this was tried'
    return 'this was not tried'


def _why_never_ready(process):
    if process.needed_topic and not process.nodes:
        return 'it ran, but never came to rospy.init_node()'
    if '/' + process.needed_topic in process.subscribed_topics:
        return f'it was not ready in time, though it listened to {process.needed_topic}'
    reason = f"it ran, but never listened to {process.needed_topic or 'the robot'}"
    heard = [topic for topic in process.subscribed_topics if topic not in process.silent_topics]
    return f"{reason}; it listened to {' and '.join(heard)}" if heard else reason


# -- the exceptions and the last line of a node's output

def printed_exceptions(printed: str, file: str = '') -> List[str]:
    """Returns the exceptions in a node's output, for example
    ``NameError: name 'raw_input' is not defined (line 54, in callback_controller)``.

    A traceback names several lines. Of these lines, the last one in the node's `file` is quoted.
    The exceptions that rospy raises while a node ends are left out.
    """
    exceptions = []
    for traceback in _tracebacks_in(printed):
        error_lines = filter(ERROR_LINE.match, traceback.splitlines()[1:])
        exception = next(error_lines, '')
        searched_text = exception or traceback
        if any(text in searched_text for text in CLOSED_TOPIC_TEXTS):
            continue
        quoted = exception[:MAX_QUOTE_LENGTH] or 'an exception'
        exceptions.append(quoted + _place_in_parentheses(traceback, file))
    return exceptions


def _tracebacks_in(printed):
    """Returns the tracebacks in a node's output, or its syntax errors if it has no traceback. Each
    text continues until the next traceback. A traceback that led to the next one is left out."""
    _, *tracebacks = printed.split(TRACEBACK)
    if not tracebacks:
        _, *tracebacks = SYNTAX_ERROR.split(printed)
    return [traceback for traceback in tracebacks if not CAUSE_OF_NEXT.search(traceback)]


def _place_in_parentheses(traceback, file):
    """Returns ' (line N, in FUNCTION)', the last place in the node's file that a traceback names.
    If the traceback does not name this file, returns the last place outside SYSTEM_FOLDERS."""
    frames = TRACEBACK_FRAME.findall(traceback)
    node_places = [place for path, *place in frames if file and path.rpartition('/')[2] == file]
    student_places = [place for path, *place in frames if not path.startswith(SYSTEM_FOLDERS)]
    places = node_places or student_places
    if places:
        line, function = places[-1]
        return f' (line {line}, in {function})' if function.isidentifier() else f' (line {line})'
    if "'NoneType' object is not callable" in traceback:    # rospy got self.f(), which is None
        return ' (was a callback given as self.f(), not as self.f?)'
    return ''


def exceptions_in(scene: Scene) -> List[str]:
    return printed_exceptions(scene.printed, scene.observation.file)


def last_line(printed: str) -> str:
    """Returns the last line of a node's output, in quotes; a clause if the output is empty."""
    lines = printed.strip().splitlines()
    return repr(lines[-1].strip()[:MAX_QUOTE_LENGTH]) if lines else 'it printed nothing'


def last_exception(printed: str, file: str) -> str:
    """Returns the last exception in a node's output, in quotes. If the output has no exception,
    returns the last line in quotes."""
    exceptions = printed_exceptions(printed, file)
    return repr(exceptions[-1]) if exceptions else last_line(printed)
