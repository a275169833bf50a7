"""One line of the doctor: a verdict, its subject, the reason, and the remedy."""
from dataclasses import dataclass
from enum import Enum
from typing import Sequence


class Verdict(Enum):
    """How bad a finding is. Its value is the word in front of the line."""

    OK = 'ok'
    WARNING = 'warning'
    FAULT = 'FAULT'


#: Colours of a terminal: green, yellow, red.
COLOURS = {Verdict.OK: '32', Verdict.WARNING: '33', Verdict.FAULT: '1;31'}


@dataclass(frozen=True)
class Line:
    """`text` is the reason. `remedy` is the thing to do; '' if nothing is to be done."""

    verdict: Verdict
    subject: str
    text: str
    remedy: str = ''


def ok(subject: str, text: str) -> Line:
    """Returns a line on a thing that is right."""
    return Line(Verdict.OK, subject, text)


def warning(subject: str, text: str, remedy: str) -> Line:
    """Returns a line on a thing that may cause a problem."""
    return Line(Verdict.WARNING, subject, text, remedy)


def fault(subject: str, text: str, remedy: str) -> Line:
    """Returns a line on a thing that keeps a lab from working."""
    return Line(Verdict.FAULT, subject, text, remedy)


def printed(line: Line, in_colour: bool = False) -> str:
    """Returns the line as a single line of text. Texts of other programs may contain line ends, or
    codes that a terminal obeys: these become spaces."""
    word = line.verdict.value.ljust(7)
    if in_colour:
        word = '\033[{}m{}\033[0m'.format(COLOURS[line.verdict], word)
    text = '{:<8} {}{}'.format(line.subject, line.text,
                               '. Do: ' + line.remedy if line.remedy else '')
    return '{} {}'.format(word, ''.join(sign if sign.isprintable() else ' ' for sign in text))


def summary(lines: Sequence[Line]) -> str:
    """Returns the last line: how many faults and warnings there are."""
    faults, warnings = _count(lines, Verdict.FAULT), _count(lines, Verdict.WARNING)
    counted = ', '.join('{} {}{}'.format(number, noun, '' if number == 1 else 's')
                        for number, noun in ((faults, 'fault'), (warnings, 'warning')) if number)
    if not faults:
        return 'no fault found' + (', ' + counted if counted else '')
    return counted + (': begin with the first fault' if faults > 1 else '')


def exit_status(lines: Sequence[Line]) -> int:
    """1 if there is a fault, else 0."""
    return 1 if _count(lines, Verdict.FAULT) else 0


def _count(lines: Sequence[Line], verdict: Verdict) -> int:
    return sum(line.verdict is verdict for line in lines)
