"""Which fields of a student's own message hold the mouse?

Students define the message of the IMU lab themselves: `activestatus` for `status`, `bool` for
`std_msgs/Bool`, an extra `zPos`. Fields are matched by name, else by type and position.
"""
from typing import List, NamedTuple, Optional, Sequence, Tuple

#: The handout's names.
STATUS, X, Y = 'status', 'xPos', 'yPos'
FLAGS = ('bool', 'std_msgs/Bool')
NUMBERS = ('float32', 'float64', 'std_msgs/Float32', 'std_msgs/Float64')


class MouseFields(NamedTuple):
    """The names of the fields, the types of each, and sentences about names that differ."""

    names: Tuple[str, str, str]     # of status, x and y
    types: Tuple[str, str, str]
    remarks: List[str]


def mouse_fields(names: Sequence[str], types: Sequence[str]) -> MouseFields:
    """The fields of the mouse in a message with these fields and types, in their order.

    ``ValueError``, a clause, if the message has no flag or fewer than two numbers.
    """
    flags = [pair for pair in zip(names, types) if pair[1] in FLAGS]
    numbers = [pair for pair in zip(names, types) if pair[1] in NUMBERS]
    if not flags or len(numbers) < 2:
        raise ValueError('its message has no flag and two numbers, but {}'.format(', '.join(
            '{} {}'.format(kind, name) for name, kind in zip(names, types)) or 'no field'))
    status = _named(STATUS, flags) or flags[0]
    x, y = _named(X, numbers), _named(Y, numbers)
    if not (x and y):
        x, y = numbers[:2]
    chosen = (status[0], x[0], y[0])
    remarks = ['Your {} was taken for {}.'.format(name, usual)
               for name, usual in zip(chosen, (STATUS, X, Y)) if name != usual]
    return MouseFields(chosen, (status[1], x[1], y[1]), remarks)


def _named(usual: str, fields: List[Tuple[str, str]]) -> Optional[Tuple[str, str]]:
    """The field that is called so, in upper or lower case, also without `Pos`; None: none is."""
    for wanted in (usual.lower(), usual.lower().replace('pos', '')):
        for name, kind in fields:
            if name.lower().replace('_', '') == wanted:
                return name, kind
    return None
