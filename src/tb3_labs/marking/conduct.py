"""Findings on things that no student's node needs to do: for the instructor, not for the marks.

Each finding is one sentence with the evidence. It costs no points: the robot's true motion is
judged, and only the robot's own messages count. A person decides.

Programs are alike even if names and comments were changed: a program becomes the set of its
shingles, runs of LENGTH tokens in a row. Comments and docstrings are left out. Strings and numbers
lose their values. Names are numbered in the order in which a run uses them. The likeness of two
programs is the share of the smaller set that is also in the other.

Source: k-gram fingerprints as in Schleimer, Wilkerson, Aiken, "Winnowing: local algorithms for
document fingerprinting", SIGMOD 2003; all k-grams are kept, since these texts are short.
"""
import io
import itertools
import keyword
import tokenize
from typing import Any, Dict, FrozenSet, Iterable, List, Mapping, Sequence, Tuple

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
#: Tokens in a shingle, about two lines.
LENGTH = 16
#: Two texts with at least this likeness are nearly the same. The handout gives everybody the same
#: skeleton: turtlebot_controller.py of three real teams had likenesses of 0.50, 0.53 and 0.69. A
#: copy with other names, other strings, other comparisons and its methods in another order had
#: 0.85. A copy with only other names had 1.
NEARLY_SAME = 0.8
#: A text with fewer shingles is too short to compare: all students write the same. Without the
#: shingles of the skeletons, the handouts' nodes have 80 (IMU exercise; 160 with its skeleton), 105
#: (gamepad), 274 (move to goal) and 352 (turns).
FEWEST = 200
IGNORED = (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT,
           tokenize.ENCODING, tokenize.ENDMARKER)
Shingles = FrozenSet[Tuple[str, ...]]


def published(node: str, topic: str, inputs: Iterable[str], truth: Sequence[str]) -> str:
    """The finding on a node that publishes on `topic`; '' if this is allowed. Names are resolved.

    `inputs`: topics on which the marker publishes; `truth`: names of the true poses' topic.
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
    """The findings on changed values of the robot, except SWITCHES; `what`: parameter, setting."""
    return ['A {} of the robot was changed: {} from {} to {}.'.format(
        what, name, before.get(name, 'none'), now.get(name, 'none'))
        for name in sorted(set(before) | set(now))
        if name not in SWITCHES and before.get(name) != now.get(name)]


def for_instructor(all_marks: Sequence[Marks], texts: Mapping[str, str],
                   published: Mapping[str, str], unprotected: bool = False,
                   given: Sequence[str] = ()) -> List[str]:
    """The lines for the instructor: all findings, and a warning if there were no sandboxes.

    `texts`: student -> the node's program; other arguments: see nearly_same().
    """
    lines = [UNPROTECTED] if unprotected else []
    for marks in all_marks:
        lines += ['To look at: {}: {}'.format(marks.student, finding)
                  for finding in marks.findings]
    return lines + [
        'To look at: {} and {} are nearly the same text: {:.0f} % of the shorter one.'.format(
            one, other, 100.0 * share)
        for one, other, share in nearly_same(texts, published, given)]


# -- how alike two programs are

def tokens_of(code: str) -> List[str]:
    """The tokens of a program: a number becomes 0, a string '', a name gets a blank in front."""
    found, begins_line = [], True
    try:
        for kind, text, _, _, _ in tokenize.generate_tokens(io.StringIO(code).readline):
            if kind not in IGNORED and not (kind == tokenize.STRING and begins_line):
                found.append(_plain(text, kind == tokenize.STRING))
            begins_line = kind in IGNORED and (begins_line or kind != tokenize.COMMENT)
    except (tokenize.TokenError, SyntaxError):
        pass        # not valid Python; the tokens up to there are enough
    return found


def _plain(text: str, is_string: bool) -> str:
    if is_string:
        return "''"
    if text[0].isdigit() or text[0] == '.' and text[1:2].isdigit():
        return '0'
    return ' ' + text if text.isidentifier() and not keyword.iskeyword(text) else text


def shingles(code: str) -> Shingles:
    tokens = tokens_of(code)
    return frozenset(_renamed(tokens[begin:begin + LENGTH])
                     for begin in range(len(tokens) - LENGTH + 1))


def _renamed(tokens: Sequence[str]) -> Tuple[str, ...]:
    """A run of tokens; its names are replaced by name1, name2, ... in their order."""
    known: Dict[str, str] = {}
    return tuple(known.setdefault(token, 'name{}'.format(len(known) + 1))
                 if token.startswith(' ') else token for token in tokens)


def likeness(one: Shingles, other: Shingles) -> float:
    """The share of the smaller set that is also in the larger; 0 if a set has fewer than FEWEST."""
    smaller = min(len(one), len(other))
    return len(one & other) / smaller if smaller >= FEWEST else 0.0


def nearly_same(submitted: Mapping[str, str], published: Mapping[str, str],
                given: Iterable[str] = ()) -> List[Tuple[str, str, float]]:
    """(one, other, likeness) of each pair that is nearly the same, the most alike first.

    `submitted`, `published`: name -> program; published ones are not compared with each other.
    `given`: programs that every student was given; their shingles do not count.
    """
    common = frozenset().union(*(shingles(code) for code in given))
    students, others = ([(name, shingles(code) - common) for name, code in sorted(texts.items())]
                        for texts in (submitted, published))
    found = [(one, other, likeness(first, second))
             for (one, first), (other, second) in itertools.chain(
                 itertools.combinations(students, 2), itertools.product(students, others))]
    return sorted((pair for pair in found if pair[2] >= NEARLY_SAME),
                  key=lambda pair: -pair[2])
