"""Is something wrong with this computer, its network or a robot? Each finding is one printed line.

A function ``judge_*`` turns numbers and names into a Finding. The module `checks` measures, and
calls the functions ``judge_*`` in order.

At first the doctor is not a node, and only makes XML-RPC calls. After the line `Way back` is
printed, the doctor listens to the robot as an ordinary node that publishes nothing.
"""
from collections import Counter
from functools import partial
from typing import NamedTuple, Sequence

BRINGUP_REMEDY = "restart the robot's bringup, and look at its first lines"


class Finding(NamedTuple):
    """The state of one `subject`, such as the clock, and an instruction for the user."""

    severity: str       # 'ok', 'warning' or 'FAULT'
    subject: str
    text: str           # the reason
    remedy: str = ''    # an instruction


#: `ok(subject, text)` returns a Finding about a thing that works. `warning(subject, text, remedy)`
#: returns a Finding about a possible problem. `fault(subject, text, remedy)` returns a Finding
#: about a problem that prevents a lab.
ok = partial(Finding, 'ok')
warning = partial(Finding, 'warning')
fault = partial(Finding, 'FAULT')


def as_text(finding: Finding) -> str:
    """Returns a finding as one line of text. Each character that cannot be printed, such as a line
    end, becomes a space."""
    text = '{:<7} {:<8} {}'.format(finding.severity, finding.subject, finding.text)
    if finding.remedy:
        text += '. Do: ' + finding.remedy
    return ''.join(character if character.isprintable() else ' ' for character in text)


def summary(findings: Sequence[Finding]) -> str:
    """Returns the doctor's last line, which has the numbers of faults and warnings."""
    counts = Counter(finding.severity for finding in findings)
    first = '; begin with the first fault' if counts['FAULT'] > 1 else ''
    return f'faults: {counts["FAULT"]}, warnings: {counts["warning"]}{first}'
