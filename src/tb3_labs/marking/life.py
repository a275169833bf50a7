"""What every node should do: start, and end at Ctrl+C."""
import re
from typing import List, Optional

from tb3_labs.marking.criteria import first_missed
from tb3_labs.marking.observation import WAS_MOVING, Observation, Scene, Stimulus

#: Ctrl+C, and two more chances: the last message that rospy publishes may be lost.
CTRL_C = ('Ctrl+C', 'Ctrl+C again', 'Ctrl+C a third time')
#: Keys of its facts: the time until the node had ended [s], None if it had to be killed; the number
#: of the signal that ended it, 0 if it ended by itself.
TOOK = 'took'
SIGNAL = 'signal'
#: Signals that end a node as it should end: by itself, by SIGINT, by SIGTERM.
ORDERLY = (0, 2, 15)
#: A node must run, and listen to its topic, within this time [s].
START_TIME = 15.0
#: A node that still runs after this time hangs [s]; rospy itself needs up to 2 s.
ENDING = 5.0
#: A zero velocity must have been sent by then [s].
STOPPING = 0.5
#: What a criterion about Ctrl+C is judged by, in words.
IN_TIME, ENDS_IN_TIME, STOPS_IN_TIME = (
    'within {:g} s'.format(time) for time in (START_TIME, ENDING, STOPPING))
#: How a traceback begins, also in the middle of a line of a log.
TRACEBACK_LINE = 'Traceback (most recent call last)'
TRACEBACK = re.compile(re.escape(TRACEBACK_LINE))
ERROR = re.compile(r'\w[\w.]*(Error|Exception|Interrupt|Exit)\b')
#: rospy itself raises this in a callback that publishes while the node ends.
NOT_THEIRS = 'publish() to a closed topic'
#: What a clean exit is, and how it is judged, in words.
CLEAN_EXIT = 'at Ctrl+C ends by itself, without a traceback'
CLEAN_EXIT_LIMITS = '{}; "{}", which rospy raises, does not count'.format(ENDS_IN_TIME, NOT_THEIRS)


def starts(seen: Observation) -> str:
    """Does it run, and listen to the robot?"""
    return seen.why_missing() if not seen.runs or seen.runs[0].ready is None else ''


def clean_exit(seen: Observation) -> str:
    """Does it end by itself, without a traceback, at each Ctrl+C?"""
    scenes = [seen.during(name, may_die=True) for name in CTRL_C if seen.has(name)] or [
        seen.during(CTRL_C[0])]
    return first_missed(*map(_clean_exit, scenes))


def _clean_exit(scene: Scene) -> str:
    if scene.facts[TOOK] is None:
        return 'it was still running {:g} s after Ctrl+C and had to be killed'.format(ENDING)
    error = traceback_in(scene.printed)
    if error is not None:
        return 'it ended with a traceback' + (error and ': ' + error)
    if scene.facts[SIGNAL] not in ORDERLY:
        return 'it was ended by signal {}'.format(scene.facts[SIGNAL])
    return ''


def traceback_in(printed: str) -> Optional[str]:
    """The error of a traceback of the node, in quotes, or '' if it cannot be told; None if there is
    no traceback, or only one of rospy itself."""
    if not TRACEBACK.search(printed):
        return None
    errors = [line for line in printed.splitlines()
              if ERROR.match(line) and NOT_THEIRS not in line]
    if not errors and NOT_THEIRS in printed:
        return None
    return repr(errors[-1][:120]) if errors else ''


def tracebacks_before_the_end(stimulus: Stimulus) -> List[str]:
    """A sentence on a traceback that is no matter of Ctrl+C, which else nobody would be told."""
    error = traceback_in(stimulus.printed) if stimulus.name not in CTRL_C else None
    return [] if error is None else [
        'A traceback was printed during "{}"{}. The clean exit is about Ctrl+C alone.'.format(
            stimulus.name, error and ': ' + error)]


def stops_robot(seen: Observation) -> str:
    """Does it send a zero velocity, at one Ctrl+C of several?"""
    scenes = [seen.during(name, may_die=True) for name in CTRL_C if seen.has(name)] or [
        seen.during(CTRL_C[0])]
    if not any(scene.facts[WAS_MOVING] for scene in scenes):
        return 'it did not move the robot before Ctrl+C, so that a stop could not be seen'
    for scene in scenes:
        soon = scene.commands[scene.commands[:, 0] <= scene.begin + STOPPING]
        if scene.facts[WAS_MOVING] and (soon[:, 1:] == 0.0).all(axis=1).any():
            return ''
    return 'at Ctrl+C in the middle of a movement it sent no zero velocity: the robot went on'


def says(seen: Observation, words: str) -> str:
    """Are these words printed at Ctrl+C?"""
    scene = seen.during(CTRL_C[0], may_die=True)
    return '' if words in scene.printed else '"{}" was not printed at Ctrl+C'.format(words)
