#!/usr/bin/env python3
"""Writes the tables of the lab sheets' sections "What is graded".

    python3 doc/instructor/make_graded.py

A criterion and its numbers stand in `src/tb3_labs/marking/labs/LAB.py`, its points in
`launch/checks/points.yaml`. `test/unit/test_sheets.py` compares the sheets with this command.
"""
import pathlib
import re

import yaml

from tb3_labs.marking.marks import LABS, points_of

ROOT = pathlib.Path(__file__).resolve().parents[2]
POINTS = ROOT / 'launch' / 'checks' / 'points.yaml'
#: The comment before the table of a lab or the list of its extra criteria, and that table or list.
#: If a sheet has no list for a lab, the extra criteria are in the table.
MADE_PART = re.compile(r'(<!-- (\w+)( extras)?: made by make_graded\.py -->\n\n)((?:[|*].*\n)*)')
HEAD = '| criterion | what is asked | limits | points |\n|---|---|---|---|\n'


def extras(lab):
    """Returns the list of the criteria beyond the handout, in Markdown."""
    return ''.join(f'* `{c.label}`: {c.meaning}{c.limits and ", " + c.limits}\n'
                   for c in LABS[lab].criteria if c.extra)


def table(lab, with_extras=True):
    """Returns the table of a lab, in Markdown: the handout's criteria, then the extra criteria."""
    criteria = [c for c in LABS[lab].criteria if with_extras or not c.extra]
    worth = points_of(lab, yaml.safe_load(POINTS.read_text(encoding='utf-8')))
    rows = [f'| `{c.label}` | {c.meaning} |{c.limits and " " + c.limits} | {worth[c.name]:g} |\n'
            for c in sorted(criteria, key=lambda c: c.extra)]
    total = sum(worth[c.name] for c in criteria if not c.extra)
    return HEAD + ''.join(rows) + f'| | | full marks | {total:g} |\n'


def with_tables(sheet):
    """Returns the text of a sheet with its tables and lists made anew."""
    listed = {found.group(2) for found in MADE_PART.finditer(sheet) if found.group(3)}

    def made(found):
        comment, lab, is_list, _ = found.groups()
        return comment + (extras(lab) if is_list else table(lab, lab not in listed))
    return MADE_PART.sub(made, sheet)


def main():
    """Write the tables into the sheets."""
    for name in sorted({c.where.sheet for lab in LABS.values() for c in lab.criteria}):
        path = ROOT / 'doc' / name
        path.write_text(with_tables(path.read_text(encoding='utf-8')), encoding='utf-8')


if __name__ == '__main__':
    main()
