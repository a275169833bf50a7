"""The points of each criterion, from a table that an instructor edits.

The table has a lab's name at its first level, the criteria's names at its second, and below
`extra` those beyond the handout:

    turn:
      left: 3
      extra: {within_1_deg: 0}
"""
import math


def points_of(lab, criteria, table):
    """criterion -> points, all of them; ``ValueError`` where the table is no such table."""
    if not isinstance(table, dict) or not isinstance(table.get(lab), dict):
        raise ValueError('the points have no section "{}"'.format(lab))
    given = dict(table[lab])
    extra = given.pop('extra', {})
    if not isinstance(extra, dict):
        raise ValueError('{}: "extra" is a section of its own'.format(lab))
    worth = {}
    for section, names in ((given, [c.name for c in criteria if not c.extra]),
                           (extra, [c.name for c in criteria if c.extra])):
        for name in section:
            if name not in names:
                raise ValueError('{}: no criterion is called "{}"; these are: {}'.format(
                    lab, name, ', '.join(names)))
        for name in names:
            worth[name] = _checked(lab, name, section.get(name))
    return worth


def _checked(lab, name, points):
    if isinstance(points, bool) or not isinstance(points, (int, float)) or not (
            math.isfinite(points) and points >= 0):
        raise ValueError('{}: {} = {!r} is not valid: a number of at least 0'.format(
            lab, name, points))
    return points
