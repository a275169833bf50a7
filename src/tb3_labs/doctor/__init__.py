"""What is wrong with this computer, its network or a robot? Each finding is a line.

A function ``judge_*`` turns numbers and names into one Line with a severity, a reason and a remedy.
`checks` measures, and calls these functions in order.

At first the doctor only makes XML-RPC calls, which need neither rospy nor a node. After the line
`Way back` the doctor listens to the robot as an ordinary node that publishes nothing.
"""
from functools import partial
from typing import NamedTuple, Sequence


class Line(NamedTuple):
    """One finding."""

    severity: str       # 'ok', 'warning' or 'FAULT'
    subject: str
    text: str           # the reason
    remedy: str = ''    # an instruction for the user


#: ok(subject, text) returns a Line about a thing that works, warning(subject, text, remedy) about a
#: possible problem, and fault(subject, text, remedy) about a problem that prevents a lab.
ok, warning, fault = (partial(Line, severity) for severity in ('ok', 'warning', 'FAULT'))


def as_text(line: Line) -> str:
    """Returns a finding as one line of text. Line ends and terminal codes, which texts of other
    programs may contain, become spaces."""
    text = '{:<7} {:<8} {}'.format(line.severity, line.subject, line.text)
    if line.remedy:
        text += '. Do: ' + line.remedy
    return ''.join(sign if sign.isprintable() else ' ' for sign in text)


def summary(lines: Sequence[Line]) -> str:
    """Returns the last line: the number of faults, or a hint if there are only warnings."""
    faults = sum(line.severity == 'FAULT' for line in lines)
    if faults > 1:
        return f'{faults} faults: begin with the first fault'
    if faults:
        return '1 fault'
    if any(line.severity == 'warning' for line in lines):
        return 'no fault found, but see the warnings'
    return 'no fault found'
