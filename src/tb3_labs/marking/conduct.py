"""Findings on things that no student's node needs to do: for the instructor, not for the marks.

Each finding is one sentence with the evidence. It costs no points: the robot's true motion is
judged, and only the robot's own messages count. A person decides.
"""
import re
from typing import Any, Iterable, List, Mapping, Sequence

from tb3_labs.marking.likeness import nearly_same
from tb3_labs.marking.marks import Marks
from tb3_labs.marking.observation import CLOCK, CMD_VEL, IMU, JOINT_STATES, ODOM, RESET

#: The protection that is left without sandboxes.
UNPROTECTED = "No sandboxes: a submission's program can read and delete your files and use the " \
    'network; it can write no large file, and every process of it that can be found is killed.'
#: The messages of these topics come from the robot, or from the marker.
ROBOTS = (CLOCK, IMU, JOINT_STATES, ODOM)
#: Settings of the robot that the marker itself switches.
SWITCHES = IMU_SWITCH, ODOM_SWITCH = 'imu_silent', 'odom_silent'
#: The file with the node's text, in the logs, has the student's name and this ending.
NODE_TEXT = '.node.txt'
#: Modules of this package that every node may import begin so.
SHARED = ('tb3_labs.msg.', 'tb3_labs.srv.')
IMPORT = re.compile(r'^\s*(?:from\s+(tb3_labs[\w.]*)\s+import\s+([\w, ]+)|'
                    r'import\s+(tb3_labs[\w.]*))')
#: A name in quotes, as importlib takes it.
QUOTED = re.compile(r'''["'](tb3_labs\.\w[\w.]*)["']''')


def published(node: str, topic: str, inputs: Iterable[str], truth: Sequence[str]) -> str:
    """Returns the finding on a node that publishes on `topic`; '' if this is allowed.

    `inputs`: topics on which the marker publishes; `truth`: names of the true poses' topic. All
    names are resolved.
    """
    name = topic.lstrip('/')
    if topic in truth:
        return '{} publishes on {}, where the robot tells its true pose.'.format(node, topic)
    if name == RESET:
        return "{} publishes on {}, the robot's own reset.".format(node, topic)
    if name in ROBOTS:
        return '{} publishes on {}, as if it were the robot.'.format(node, topic)
    if topic in inputs and name != CMD_VEL:
        return '{} publishes on {}, as if it were the person at the controls.'.format(node, topic)
    return ''


def listened(node: str, topic: str, truth: Sequence[str], markers: Iterable[str]) -> str:
    """Returns the finding on a node that listens to `topic`; '' if this is allowed.

    `truth`: as for published(); `markers`: namespaces of the robot's settings and of the marker.
    """
    if topic in truth:
        return '{} listens to {}, which tells the true pose.'.format(node, topic)
    if any(topic.startswith(space + '/') for space in markers):
        return '{} listens to {}, which is for the marker alone.'.format(node, topic)
    return ''


def changed(before: Mapping[str, Any], now: Mapping[str, Any], what: str) -> List[str]:
    """Returns the findings on changed values of the robot; `what`: 'parameter' or 'setting'.

    SWITCHES do not count, because the marker itself changes them.
    """
    return ['A {} of the robot was changed: {} from {} to {}.'.format(
        what, name, before.get(name, 'none'), now.get(name, 'none'))
        for name in sorted(set(before) | set(now))
        if name not in SWITCHES and before.get(name) != now.get(name)]


def laws_imported(file: str, code: str) -> List[str]:
    """The findings on a Python file that uses more of this package than its messages."""
    found = []
    for number, line in enumerate(code.splitlines(), 1):
        found += ['{}, line {}, uses {} of this package.'.format(file, number, name)
                  for name in QUOTED.findall(line) + _imported(line)
                  if not (name + '.').startswith(SHARED)]
    return list(dict.fromkeys(found))


def _imported(line: str) -> List[str]:
    match = IMPORT.match(line)
    if match is None:
        return []
    module, names, plain = match.groups()
    if plain:
        return [plain] if '.' in plain else []
    return ['{}.{}'.format(module, name.split()[0]) for name in names.split(',') if name.split()]


def for_instructor(all_marks: Sequence[Marks], texts: Mapping[str, str],
                   published: Mapping[str, str], unprotected: bool = False,
                   given: Sequence[str] = ()) -> List[str]:
    """Returns the lines for the instructor: a warning if there were no sandboxes, and all findings.

    `texts`: student -> the node's program; `published`: name -> program of this package; `given`:
    programs of the skeletons.
    """
    lines = [UNPROTECTED] if unprotected else []
    for marks in all_marks:
        lines += ['To look at: {}: {}'.format(marks.student, finding)
                  for finding in marks.findings]
    return lines + [
        'To look at: {} and {} are nearly the same text: {:.0f} % of the shorter one.'.format(
            one, other, 100.0 * share)
        for one, other, share in nearly_same(texts, published, given)]
