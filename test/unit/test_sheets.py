"""The lab sheets hold every number that is graded, and the place to which each criterion points."""
import pathlib
import re
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / 'doc' / 'instructor'))

import make_graded
from tb3_labs.marking.marks import LABS

CRITERIA = [criterion for lab in LABS.values() for criterion in lab.criteria]


def read(sheet):
    return (ROOT / 'doc' / sheet).read_text(encoding='utf-8')


def text_at(place):
    """The text of a place in a sheet, on one line: a section up to the next, or one step of it."""
    found = re.search(r'^#+ {}\n(.*?)(?=^#+ |\Z)'.format(re.escape(place.heading)),
                      read(place.sheet), re.M | re.S)
    assert found, place
    text = found.group(1)
    if place.step:
        step = re.search(r'^{}\. (.*?)(?=^\d+\. |\Z)'.format(place.step), text, re.M | re.S)
        assert step, place
        text = step.group(1)
    return ' '.join(text.split())


@pytest.mark.parametrize('sheet', sorted({criterion.where.sheet for criterion in CRITERIA}))
def test_the_sheets_have_the_tables_of_the_code(sheet):
    assert make_graded.with_tables(read(sheet)) == read(sheet)


def test_every_pointer_leads_to_a_place():
    assert [criterion.where for criterion in CRITERIA if len(text_at(criterion.where)) < 50] == []


def test_the_open_todos_that_the_sheets_show_are_those_of_the_skeletons():
    skeletons = ''.join(path.read_text(encoding='utf-8') for path in sorted(
        (ROOT / 'doc' / 'skeletons').glob('*/src/*')))
    shown = [line.strip() for sheet in ('imu_lab.md', 'transformation_lab.md')
             for line in read(sheet).splitlines() if re.match(r' *TODO \d+ is open', line)]
    assert len(shown) > 2 and [line for line in shown if line not in skeletons] == []


def test_every_question_has_an_answer():
    answers = read('instructor/teaching.md').split('## Answers')[1]
    for lab, sheet in (('IMU', 'imu_lab.md'), ('Transformation', 'transformation_lab.md')):
        questions = read(sheet).split('## Questions')[1].split('\n## ')[0]
        assert re.findall(r'^\d+\.', questions, re.M) == re.findall(
            r'^\d+\.', answers.split(lab + ' lab:')[1].split(' lab:')[0], re.M)
