"""Is an answer to a mystery robot right: the fault, and its value?

Units: each fault's value has a unit of its own. Edge cases: a wrong fault in an answer tells
nothing about the right one; an angle may be off by whole turns; an answer without a value is not
complete, so it is not right.
"""
import difflib
import math
from typing import Optional, Tuple

from tb3_labs.geometry.angle_arrays import difference_degrees
from tb3_labs.simulation.mystery_robot import FAULT_KINDS, Fault, draw

#: Added to the tolerance, so that rounding does not make a value at the limit wrong.
ROUNDING = 1e-9


def fault_called(name: str) -> Fault:
    """Returns the fault called `name`; capitals and the order of the words do not matter. Raises
    ``ValueError`` for an unknown name."""
    for fault in FAULT_KINDS:
        if _words(fault.name) == _words(name):
            return fault
    names = [fault.name for fault in FAULT_KINDS]
    near = difflib.get_close_matches(name.lower(), names, n=1)
    raise ValueError('{!r} is not a fault. {}Valid: {}'.format(
        name, 'Did you mean {!r}? '.format(near[0]) if near else '', ', '.join(names)))


def _words(name: str) -> Tuple[str, ...]:
    return tuple(sorted(name.lower().replace('_', ' ').replace('-', ' ').split()))


def judge(number: int, name: str, value: Optional[float] = None) -> Tuple[bool, str]:
    """Returns (is the answer right?, the words for the student). Raises ``ValueError`` if the
    number, the fault or the value is not valid."""
    hidden, truth, _ = draw(number)
    named = fault_called(name)
    if value is not None and not math.isfinite(value):
        raise ValueError('value = {} is not valid: a number in {}'.format(value, named.unit))
    if named is not hidden:
        return False, 'Wrong: mystery {} has another fault. If it were {!r}: {}'.format(
            number, named.name, named.shows)
    if value is None:
        return False, 'The fault is right. Now measure its value in {}: {}.'.format(
            hidden.unit, hidden.value)
    off = abs(_difference(hidden, value, truth))
    if off <= hidden.tolerance + ROUNDING:
        return True, 'Right: mystery {} is {!r}, {}. Your {} is off by {}.'.format(
            number, hidden.name, shown(hidden, truth), _given(hidden, value), _given(hidden, off))
    words = 'The fault is right, its value is not: {} is off by {}; right is within {}.'.format(
        _given(hidden, value), _given(hidden, off), _given(hidden, hidden.tolerance))
    mirrored = abs(_difference(hidden, -value, truth))
    if hidden.signed and mirrored <= hidden.tolerance + ROUNDING:
        words += ' The size is right, the sign is not: the value is {}.'.format(hidden.value)
    return False, words


def _difference(fault: Fault, value: float, truth: float) -> float:
    return difference_degrees(value, truth) if fault.unit == 'deg' else value - truth


def shown(fault: Fault, value: float) -> str:
    """A value as it was drawn, with its unit; a signed value shows its +, too."""
    return '{:{}.{}f} {}'.format(value, '+' if fault.signed else '', fault.digits, fault.unit)


def _given(fault: Fault, value: float) -> str:
    return '{:g} {}'.format(round(value, fault.digits + 1), fault.unit)
