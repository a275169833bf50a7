"""One line of the doctor: a verdict, its subject, the reason, and what to do."""
from dataclasses import dataclass
from enum import Enum
from typing import Sequence


class Verdict(Enum):
    """How bad it is. The value is the word in front of the line."""

    OK = 'ok'
    WARNING = 'warning'
    FAULT = 'FAULT'


#: Colours of a terminal: green, yellow, red.
COLOURS = {Verdict.OK: '32', Verdict.WARNING: '33', Verdict.FAULT: '1;31'}


@dataclass(frozen=True)
class Line:
    """`text` is the reason. `remedy` is what a person should do; '' where nothing is to be done."""

    verdict: Verdict
    subject: str
    text: str
    remedy: str = ''


def ok(subject: str, text: str) -> Line:
    """A line on what is as it should be."""
    return Line(Verdict.OK, subject, text)


def warning(subject: str, text: str, remedy: str) -> Line:
    """A line on what may harm."""
    return Line(Verdict.WARNING, subject, text, remedy)


def fault(subject: str, text: str, remedy: str) -> Line:
    """A line on what keeps a lab from working."""
    return Line(Verdict.FAULT, subject, text, remedy)


def printed(line: Line, in_colour: bool = False) -> str:
    """The line as text, always a single one: what others say may contain line ends, or codes that
    a terminal obeys."""
    word = line.verdict.value.ljust(7)
    if in_colour:
        word = '\033[{}m{}\033[0m'.format(COLOURS[line.verdict], word)
    text = '{:<8} {}{}'.format(line.subject, line.text,
                               '. Do: ' + line.remedy if line.remedy else '')
    return '{} {}'.format(word, ''.join(sign if sign.isprintable() else ' ' for sign in text))


def summary(lines: Sequence[Line]) -> str:
    """The last line: the sum of all."""
    faults = _count(lines, Verdict.FAULT)
    counted = ', '.join(_words(number, noun) for number, noun in (
        (faults, 'fault'), (_count(lines, Verdict.WARNING), 'warning')) if number)
    if not counted:
        return 'no fault found'
    if not faults:
        return 'no fault found, ' + counted
    return counted + (': begin with the first fault' if faults > 1 else '')


def exit_status(lines: Sequence[Line]) -> int:
    """1 if there is a fault, else 0."""
    return 1 if _count(lines, Verdict.FAULT) else 0


def _count(lines: Sequence[Line], verdict: Verdict) -> int:
    return sum(line.verdict is verdict for line in lines)


def _words(number: int, noun: str) -> str:
    return '{} {}{}'.format(number, noun, '' if number == 1 else 's')
