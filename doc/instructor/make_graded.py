#!/usr/bin/env python3
"""Writes the tables of the lab sheets' sections "What is graded".

    python3 doc/instructor/make_graded.py

The criteria and their limits stand in `src/tb3_labs/marking/labs/LAB.py`. Their points stand in
`launch/checks/points.yaml`. `test/unit/test_sheets.py` compares the sheets with these tables.
"""
import pathlib
import re

import one_line_errors    # noqa: F401 (it changes how Python reports the errors below)

from tb3_labs.marking.marks import LABS, points_of, read_points

ROOT = pathlib.Path(__file__).resolve().parents[2]
POINTS = ROOT / 'launch' / 'checks' / 'points.yaml'
#: A table of a lab's criteria, or a list of a lab's extra criteria. Before it stands a comment with
#: the lab's name. If a sheet has no list for a lab, the lab's table contains the extra criteria.
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
    graded = [criterion for criterion in LABS[lab].criteria if not criterion.is_extra]
    extra = [criterion for criterion in LABS[lab].criteria if criterion.is_extra]
    criterion_points = points_of(lab, read_points(POINTS))
    rows = []
    for criterion in [*graded, *extra] if with_extras else graded:
        limits = f' {criterion.limits}' if criterion.limits else ''
        points = criterion_points[criterion.name]
        rows.append(f'| `{criterion.label}` | {criterion.meaning} |{limits} | {points:g} |\n')
    total = sum(criterion_points[criterion.name] for criterion in graded)
    return HEAD + ''.join(rows) + f'| | | full marks | {total:g} |\n'


def with_tables(sheet):
    """Returns the text of a sheet with new tables and lists."""
    labs_with_list = {lab for _, lab, is_list, _ in MADE_PART.findall(sheet) if is_list}

    def made(found):
        comment, lab, is_list, _ = found.groups()
        if is_list:
            return comment + extras(lab)
        return comment + table(lab, with_extras=lab not in labs_with_list)
    return MADE_PART.sub(made, sheet)


def main():
    """Write the tables into the sheets."""
    criteria = [criterion for lab in LABS.values() for criterion in lab.criteria]
    for sheet in sorted({criterion.sheet_step.sheet for criterion in criteria}):
        path = ROOT / 'doc' / sheet
        path.write_text(with_tables(path.read_text(encoding='utf-8')), encoding='utf-8')


if __name__ == '__main__':
    main()
