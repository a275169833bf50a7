"""The points of each criterion, from a table that an instructor edits.

The table has a lab's name at its first level, the criteria's names at its second, and below
`extra` the criteria beyond the handout:

    turn:
      left: 3
      extra: {within_1_deg: 0}
      course: {code: 25, demonstration: 25, report: 50}

`course` is optional: see tb3_labs.marking.course.
"""
import math
from typing import Any, Dict, Iterable

from tb3_labs.marking.criteria import Criterion

#: The section of a lab's criteria beyond the handout.
EXTRA = 'extra'
#: The section of what a lab counts in the course.
COURSE = 'course'


def points_of(lab: str, criteria: Iterable[Criterion], table: Any) -> Dict[str, float]:
    """The points of each criterion, by its name.

    `table` is what yaml.safe_load() returns. ``ValueError`` if it has no section for the lab, names
    a criterion that the lab does not have, lacks one, or has points that are not valid: anything
    but a finite number of at least 0.
    """
    criteria = list(criteria)
    if not isinstance(table, dict) or not isinstance(table.get(lab), dict):
        raise ValueError('the points have no section "{}"'.format(lab))
    given = dict(table[lab])
    given.pop(COURSE, None)
    extra = given.pop(EXTRA, {})
    if not isinstance(extra, dict):
        raise ValueError('{}: "{}" is a section of its own'.format(lab, EXTRA))
    worth = {}
    for section, names in ((given, [c.name for c in criteria if not c.extra]),
                           (extra, [c.name for c in criteria if c.extra])):
        for name in section:
            if name not in names:
                raise ValueError('{}: no criterion is called "{}"; these are: {}'.format(
                    lab, name, ', '.join(names)))
        for name in names:
            worth[name] = checked_points(lab, name, section.get(name))
    return worth


def checked_points(lab: str, name: str, points: Any) -> float:
    """These points; ``ValueError`` if they are not valid."""
    if isinstance(points, bool) or not isinstance(points, (int, float)) or not (
            math.isfinite(points) and points >= 0):
        raise ValueError('{}: {} = {!r} is not valid: a number of at least 0'.format(
            lab, name, points))
    return points
