"""What is wrong with this computer, its network or a robot? Each finding is a line.

A function ``judge_*`` turns numbers and names into one Line: its severity, the reason, and what to
do. `checks` measures, and calls these functions in order.

At first the doctor needs neither rospy nor a node: it asks by XML-RPC calls that only read. After
the line `Way back` it listens to the robot, as an ordinary node that publishes nothing.
"""
from functools import partial
from typing import NamedTuple, Sequence


class Line(NamedTuple):
    """One finding. `severity`: 'ok', 'warning' or 'FAULT'; `text`: the reason; `remedy`: the thing
    to do, or ''."""

    severity: str
    subject: str
    text: str
    remedy: str = ''


#: ok(subject, text): the subject is right. warning(subject, text, remedy): it may cause a problem.
#: fault(subject, text, remedy): it prevents a lab from working.
ok, warning, fault = (partial(Line, severity) for severity in ('ok', 'warning', 'FAULT'))


def as_text(line: Line) -> str:
    """Returns the line as a single line of text. Texts of other programs may contain line ends, or
    codes that a terminal obeys: these become spaces."""
    text = '{:<7} {:<8} {}'.format(line.severity, line.subject, line.text)
    if line.remedy:
        text += '. Do: ' + line.remedy
    return ''.join(sign if sign.isprintable() else ' ' for sign in text)


def summary(lines: Sequence[Line]) -> str:
    """Returns the last line: how many faults there are, or that a warning may be the cause."""
    faults = sum(line.severity == 'FAULT' for line in lines)
    if faults > 1:
        return f'{faults} faults: begin with the first fault'
    if faults:
        return '1 fault'
    if any(line.severity == 'warning' for line in lines):
        return 'no fault found, but see the warnings'
    return 'no fault found'
