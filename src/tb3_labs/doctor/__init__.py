"""Is something wrong with this computer, its network or a robot? Each finding is one printed line.

The module `checks` measures, and calls the functions ``judge_*`` in order. Each ``judge_*`` turns
numbers and names into a Finding. At first the doctor is not a node and only makes XML-RPC calls.
After the line `Way back` the doctor is an ordinary node, which listens but publishes nothing.
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


# Each of these functions takes a subject, a text and a remedy, and returns a Finding.
ok = partial(Finding, 'ok')
warning = partial(Finding, 'warning')       # the problem may disturb a lab
fault = partial(Finding, 'FAULT')           # the problem prevents a lab


def finding_text(finding: Finding) -> str:
    """Returns a finding as one line of text. Characters that cannot be printed become spaces."""
    text = f'{finding.severity:<7} {finding.subject:<8} {finding.text}'
    if finding.remedy:
        text += '. Do: ' + finding.remedy
    return ''.join(character if character.isprintable() else ' ' for character in text)


def summary_text(findings: Sequence[Finding]) -> str:
    """Returns the doctor's last line, with the numbers of faults and warnings."""
    counts = Counter(finding.severity for finding in findings)
    hint = '; begin with the first fault' if counts['FAULT'] > 1 else ''
    return f'faults: {counts["FAULT"]}, warnings: {counts["warning"]}{hint}'
