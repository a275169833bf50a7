#!/usr/bin/env python3
"""Writes the tables of the lab sheets' sections "What is graded".

    python3 doc/instructor/make_graded.py

A criterion and its numbers stand in `src/tb3_labs/marking/labs/LAB.py`, its points in
`launch/checks/points.yaml`. `test/unit/test_sheets.py` compares the sheets with this command.
"""
import pathlib
import re

import one_line_errors    # noqa: F401 (it changes how Python reports the errors below)

from tb3_labs.marking.marks import LABS, points_of, read_points

ROOT = pathlib.Path(__file__).resolve().parents[2]
POINTS = ROOT / 'launch' / 'checks' / 'points.yaml'
#: A table of a lab, or a list of a lab's extra criteria, with the comment before the table or list.
#: If a sheet has no list for a lab, the lab's table contains the extra criteria.
MADE_PART = re.compile(r'(<!-- (\w+)( extras)?: make_graded\.py -->\n\n)((?:[|*].*\n)*)')
HEAD = '| criterion | what is asked | limits | points |\n|---|---|---|---|\n'


def extras(lab):
    """Returns the list of the criteria beyond the handout, in Markdown."""
    criterion_points = points_of(lab, read_points(POINTS))
    lines = []
    for criterion in LABS[lab].criteria:
        if criterion.is_extra:
            limits = f' ({criterion.limits})' if criterion.limits else ''
            points = criterion_points[criterion.name]
            worth = f' (points: {points:g})' if points else ''
            lines.append(f'* `{criterion.label}`{worth}: {criterion.meaning}{limits}.\n')
    return ''.join(lines)


def table(lab, with_extras=True):
    """Returns the table of a lab in Markdown. The criteria of the handout come first."""
    criteria = [c for c in LABS[lab].criteria if with_extras or not c.is_extra]
    criterion_points = points_of(lab, read_points(POINTS))
    rows = []
    for c in sorted(criteria, key=lambda c: c.is_extra):
        limits = f' {c.limits}' if c.limits else ''
        rows.append(f'| `{c.label}` | {c.meaning} |{limits} | {criterion_points[c.name]:g} |\n')
    total = sum(criterion_points[c.name] for c in criteria if not c.is_extra)
    return HEAD + ''.join(rows) + f'| | | full marks | {total:g} |\n'


def with_tables(sheet):
    """Returns the text of a sheet with new tables and lists."""
    listed = {found.group(2) for found in MADE_PART.finditer(sheet) if found.group(3)}

    def made(found):
        comment, lab, is_list, _ = found.groups()
        if is_list:
            return comment + extras(lab)
        return comment + table(lab, with_extras=lab not in listed)
    return MADE_PART.sub(made, sheet)


def main():
    """Write the tables into the sheets."""
    criteria = [criterion for lab in LABS.values() for criterion in lab.criteria]
    for sheet in sorted({criterion.sheet_step.sheet for criterion in criteria}):
        path = ROOT / 'doc' / sheet
        path.write_text(with_tables(path.read_text(encoding='utf-8')), encoding='utf-8')


if __name__ == '__main__':
    main()
