"""The instructor's answers of mystery robots. The students' archive leaves this file out."""
import re
from itertools import chain
from typing import List, Sequence

from tb3_labs.simulation.mystery_answer import MEANINGS, with_unit
from tb3_labs.simulation.mystery_robot import draw


def key(numbers: Sequence[str]) -> List[str]:
    """Returns the lines of the key for `numbers`, such as '7' or '1-12'. Raises ``ValueError`` if a
    word is not valid."""
    lines = ['number  fault            value']
    if not numbers:
        raise ValueError('a key needs a number such as 7, or a range such as 1-12')
    for number in chain.from_iterable(map(_range, numbers)):
        fault, value, _ = draw(number)
        lines.append(f'{number:6}  {fault.name:15}  {with_unit(fault, value)} '
                     f'(within {MEANINGS[fault.name].tolerance:g})')
    return lines


def _range(word: str) -> Sequence[int]:
    first, _, last = word.partition('-')
    if not re.fullmatch(r'\d{1,9}(-\d{1,9})?', word):
        raise ValueError(
            f'{word!r:.40} is not valid: a number such as 7, or a range such as 1-12')
    if not last:
        last = first
    return range(int(first), int(last) + 1)
