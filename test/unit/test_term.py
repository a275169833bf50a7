"""A term's marks: the table, with a person's columns, results.json, and marks that are kept from one
run to the next."""
import csv
import io
import json
import os
import threading
import zipfile

import pytest
import yaml

from test_marking import TABLE, marks_of, observation, turned
from tb3_labs.marking import classes, marks_folder
from tb3_labs.marking.labs import turn
from tb3_labs.marking.feedback import Table, results
from tb3_labs.marking.intake.submissions import chosen, submissions_in
from tb3_labs.marking.marks import Marks, from_record, points_of, to_record
from tb3_labs.marking.marks_folder import MarksFolder
from tb3_labs.marking.classes import MarkedClass
from tb3_labs.marking.marker import Marker
from tb3_labs.marking.intake.sandbox import UNPROTECTED
from tb3_labs.report.page.document import safe

WORTH = points_of('turn', TABLE)


def rows_of(text):
    return {row['student']: row for row in csv.DictReader(io.StringIO(text))}


# -- the table

def test_what_a_person_wrote_stays():
    ann, bo = marks_of('Ann', turned(90.0)), marks_of('Bo', turned(10.0))
    rows = rows_of(Table().renewed([ann, bo]))
    written = io.StringIO()     # as a spreadsheet writes it, with a column and a row of one's own
    writer = csv.DictWriter(written, list(rows['Ann']) + ['note'], delimiter=';')
    writer.writeheader()
    writer.writerow(dict(rows['Ann'], **{'points': '99', 'note': 'ill in May'}))
    writer.writerow(rows['Bo'])
    writer.writerow({'student': 'Cy', 'points': '30'})
    renewed = rows_of(Table('\ufeff' + written.getvalue()).renewed([ann, bo]))
    assert renewed['Ann']['note'] == 'ill in May' and renewed['Bo']['note'] == ''
    assert renewed['Cy']['points'] == '30' and list(renewed) == ['Ann', 'Bo', 'Cy']
    assert float(renewed['Ann']['points']) == ann.points


def test_columns_and_rows_of_a_person_stay_wherever_they_are_also_if_their_headings_are_equal():
    """A name that a spreadsheet would take for a formula is found again."""
    ann = marks_of('=Ann', turned(90.0))
    head, row = csv.reader(io.StringIO(Table().renewed([ann])))
    own = [['mean', '20'], ['mean', '21'], ['', 'late:'], ['Ann', 'again'], ['long'] * 60]
    table = [head[:4] + ['note', 'note', ''] + head[4:], row[:4] + ['a', 'b', 'c'] + row[4:], *own]
    text = '\n'.join(map(','.join, table))
    for _ in range(2):      # what was written stays, too
        text = Table(text).renewed([ann])
        heads, renewed, *others = csv.reader(io.StringIO(text))
        assert heads[:len(head) + 3] == head + ['note', 'note', '']
        assert renewed[:len(head) + 3] == row + ['a', 'b', 'c']
        assert [other[:2] for other in others[:4]] == own[:4] and others[4] == ['long'] * 60


# -- Gradescope

def test_results_are_as_gradescope_reads_them():
    marks = marks_of('Ann <b>', turned(90.0))
    marks.remarks, marks.seconds = ['It runs.'], 41.4
    found = json.loads(json.dumps(results(marks)))
    assert (found['visibility'], found['stdout_visibility']) == ('after_published', 'hidden')
    assert all(test['visibility'] == 'after_published' for test in found['tests'])
    assert [test['number'] for test in found['tests']] == [
        str(1 + place) for place in range(len(found['tests']))]
    assert found['score'] == pytest.approx(sum(test['score'] for test in found['tests']), abs=0.01)
    assert sum(test['max_score'] for test in found['tests']) == pytest.approx(
        marks.worth, abs=0.01)
    assert found['execution_time'] == 41 and 'It runs.' in found['output']
    first = {test['name']: test for test in found['tests']}['l turns 90 degrees left']
    assert first['status'] == 'passed' and first['score'] == first['max_score'] > 0
    missed = [test for test in found['tests'] if test['status'] == 'failed']
    assert 'see doc/' in missed[0]['output'] and {test['score'] for test in missed} == {0}


# -- kept from one run to the next

def folder_of(path, table=TABLE, lab='turn', parts=(), **options):
    return MarksFolder(path, lab, parts, points_of(lab, table), options, table is not TABLE)


def written(path, digest='digest'):
    folder, marks = folder_of(path), marks_of('Ann', turned(90.0))
    (folder.logs / 'Ann.json').write_text(marks.observation.to_json())
    folder.write(marks, digest)
    folder.write_overview()
    return marks


def test_a_record_that_lacks_a_criterion_gives_marks_of_other_parts_alone():
    record = to_record(marks_of('Ann', turned(90.0)), {'lab': 'turn'})
    del record['verdicts']['left']
    with pytest.raises(ValueError, match='left'):
        from_record(record, turn.CRITERIA, WORTH)
    assert from_record(record, turn.CRITERIA, WORTH, ['mouse']).worth == 6


def test_what_has_not_changed_is_kept(tmp_path):
    marks = written(tmp_path)
    assert marks.observation is None
    assert folder_of(tmp_path).kept('Ann', 'digest') == marks
    assert folder_of(tmp_path).kept('Ann', 'other digest') is None
    assert folder_of(tmp_path).kept('Bo', 'digest') is None
    assert folder_of(tmp_path, pad='xbox').kept('Ann', 'digest') is None
    written(tmp_path, digest='')
    assert folder_of(tmp_path).kept('Ann', 'digest') is None


def test_what_a_trial_runs_decides_whether_marks_are_kept(tmp_path, monkeypatch):
    """A simulated robot, a check or a launch file that has changed; but for the points."""
    for name in ('launch/a.launch', 'launch/checks/points.yaml', 'scripts/fake_turtlebot3.py'):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text('1')
    monkeypatch.setattr(marks_folder, 'PACKAGE', tmp_path)
    written(tmp_path / 'marks')
    assert folder_of(tmp_path / 'marks').kept('Ann', 'digest')
    (tmp_path / 'launch' / 'checks' / 'points.yaml').write_text('2')
    assert folder_of(tmp_path / 'marks').kept('Ann', 'digest')
    for name in ('launch/a.launch', 'scripts/fake_turtlebot3.py'):
        (tmp_path / name).write_text('2')
        assert folder_of(tmp_path / 'marks').kept('Ann', 'digest') is None
        written(tmp_path / 'marks')
    assert any(path.match('simulation/simulator.py') for path in marks_folder.decisive_files())


def test_marks_are_not_written_through_a_link(tmp_path):
    """A new file takes the place of a link; a folder that is one is refused."""
    mine, marks = tmp_path / 'mine', tmp_path / 'marks'
    mine.write_text('mine')
    (marks / 'logs').mkdir(parents=True)
    for name in ('Ann.html', 'marks.csv', 'overview.html', 'logs/Ann.marks.json'):
        (marks / name).symlink_to(mine)
    (marks / 'marks.csv').unlink()      # it is read before
    written(marks)
    assert mine.read_text() == 'mine' and rows_of((marks / 'marks.csv').read_text())
    (tmp_path / 'link').symlink_to(marks)
    with pytest.raises(OSError, match='link'):
        folder_of(tmp_path / 'link')


def test_new_points_reach_the_pages_without_another_try(tmp_path):
    marks = written(tmp_path)
    page, table = tmp_path / 'Ann.html', tmp_path / 'marks.csv'
    page.write_text('not written again')
    folder_of(tmp_path).write_overview()
    assert page.read_text() == 'not written again'
    changed = yaml.safe_load(yaml.safe_dump(TABLE))
    changed['turn']['left'] = 13
    log = tmp_path / 'logs' / 'Ann.json'        # an older version had observed more
    log.write_text(json.dumps(dict(json.loads(log.read_text()), looked_at=1.0)))
    folder = folder_of(tmp_path, changed)
    assert folder.kept('Ann', 'digest').points == marks.points + 10
    _, (note,) = folder.write_overview()
    assert note == 'With other points than before: Ann.'
    with pytest.raises(ValueError, match='was marked with other points .left: 13, not 3.: '):
        folder_of(tmp_path)
    assert '{:g} of {:g} points'.format(marks.points + 10, marks.worth + 10) in page.read_text()
    assert 'id="timeline"' in page.read_text()
    assert rows_of(table.read_text())['Ann']['of'] == '{:g}'.format(marks.worth + 10)


def test_marks_of_another_lab_are_not_mixed_in(tmp_path):
    written(tmp_path)
    for other in ({'lab': 'imu'}, {'parts': ['mouse']}):
        with pytest.raises(ValueError, match='has marks of turn, all parts: choose another'):
            folder_of(tmp_path, **other)


def test_a_record_that_was_cut_off_and_a_table_that_cannot_be_read(tmp_path):
    written(tmp_path)
    (tmp_path / 'logs' / 'Ann.marks.json').write_text('{"key"')
    assert folder_of(tmp_path).kept('Ann', 'digest') is None
    assert folder_of(tmp_path).write_overview() == (None, [])
    (tmp_path / 'marks.csv').write_text('my own table\n')
    with pytest.raises(ValueError, match='may hold what a person wrote: it does not begin with'):
        folder_of(tmp_path)


def test_the_instructor_is_told_and_no_student(tmp_path):
    folder = folder_of(tmp_path)
    folder.write(Marks('miller', verdicts=marks_of('', turned(90.0)).verdicts,
                       findings=['It did <that>.']), '')
    folder.write(marks_of('smith', turned(90.0)), '')
    page, lines = folder.write_overview(unprotected=True)
    assert lines == [UNPROTECTED, 'To look at: miller: It did <that>.']
    assert 'It did &lt;that&gt;.' in page.read_text()
    assert 'For the instructor' in page.read_text()
    assert 'that&gt;' not in (tmp_path / 'miller.html').read_text()
    other = folder_of(tmp_path / 'other')
    other.write(marks_of('smith', turned(90.0)), '')
    assert 'For the instructor' not in other.write_overview()[0].read_text()


# -- a class with odd submissions

def class_of(marker, folder, problems):
    return MarkedClass(marker, folder, False, problems.append)


def marked(path, acts, problems):
    """(a class marked by a marker that needs no robot, its submissions); `acts`: student -> what
    the marker does."""
    folder = folder_of(path / 'marks')
    marker = Marker('turn', WORTH, folder.logs)

    def mark(student, *_):
        act = acts.get(student)
        if isinstance(act, Exception):
            raise act
        return act() if act else marks_of(student, turned(90.0))
    marker.mark = mark
    for student in acts:
        (path / 'in' / student).mkdir(parents=True)
        (path / 'in' / student / 'turtlebot_controller.py').touch()
    return class_of(marker, folder, problems), submissions_in(path / 'in', print)


def marks_below(path):
    folder_of(path).write_overview()
    return rows_of((path / 'marks.csv').read_text())


ODD = os.fsdecode(b'M\xfcller')


def test_one_odd_submission_does_not_end_the_class(tmp_path):
    """A name that is not UTF-8, problems in the marking, odd remarks, an undrawn page."""
    odd, undrawn = marks_of('dot', turned(90.0)), marks_of('fay', turned(90.0))
    odd.remarks = ['=1+1', '\x1b[2J' + ODD, 'x' * 200000]
    undrawn.observation.runs = None
    unjudged = {'bob': RecursionError('too deep'), 'eve': MemoryError(),
                'cat': UnicodeEncodeError('utf-8', ODD, 1, 2, 'no')}
    acts = dict(unjudged, ann=None, dot=lambda: odd, fay=lambda: undrawn, **{ODD: None})
    problems = []
    marking, found = marked(tmp_path, acts, problems)
    assert marking.mark_all(found, 2) is True
    rows = marks_below(tmp_path / 'marks')
    assert set(rows) == {'ann', 'bob', 'cat', 'dot', 'eve', 'fay', 'M\\xfcller'}
    unjudged['fay'] = TypeError()
    assert rows['ann']['points'] == rows['M\\xfcller']['points'] != ''
    for student, problem in unjudged.items():
        assert rows[student]['points'] == '' and type(problem).__name__ in rows[student]['remarks']
        assert 'Not judged' in (tmp_path / 'marks' / (student + '.html')).read_text()
    assert rows['dot']['remarks'].startswith("'=1+1 \\x1b[2JM\\xfcller")
    assert len(rows['dot']['remarks']) < 5000
    assert len(problems) == 4


def test_marks_that_are_ready_at_an_interruption_are_written(tmp_path, monkeypatch):
    begun, go_on = threading.Event(), threading.Event()

    def slowly():
        begun.set()
        go_on.wait(100.0)
        return marks_of('bob', turned(90.0))

    def interrupted(tasks):
        begun.wait(100.0)
        go_on.set()
        raise KeyboardInterrupt
    marking, found = marked(tmp_path, {'ann': None, 'bob': slowly}, [])
    monkeypatch.setattr(classes, 'wait', interrupted)
    assert marking.mark_all(found, 2) is True
    assert list(marks_below(tmp_path / 'marks')) == ['ann', 'bob']


def test_a_zip_file_that_was_cut_off_is_no_zero(tmp_path):
    """It is not judged, and one line tells the instructor why."""
    with zipfile.ZipFile(str(tmp_path / 'whole.zip'), 'w') as archive:
        archive.writestr('lab2/turtlebot_controller.py', 'x' * 5000)
    (tmp_path / 'in').mkdir()
    (tmp_path / 'in' / 'ann.zip').write_bytes((tmp_path / 'whole.zip').read_bytes()[:3000])
    folder = folder_of(tmp_path / 'marks')
    marking = class_of(Marker('turn', WORTH, folder.logs), folder, [])
    assert marking.mark_all(submissions_in(tmp_path / 'in', print), 1) is True
    said = 'The zip file cannot be unpacked: File is not a zip file.'
    assert folder.write_overview()[1] == ['To look at: ann: Not judged: ' + said]
    row = marks_below(tmp_path / 'marks')['ann']
    assert row['points'] == row['starts'] == '' and row['remarks'] == said
    page = (tmp_path / 'marks' / 'ann.html').read_text()
    assert 'Not judged.' in page and page.count(said) == 1 and 'never started' not in page
    assert not (tmp_path / 'marks' / 'gradescope' / 'ann' / 'results.json').exists()


@pytest.mark.parametrize('text, cell', [
    ('=1+1', "'=1+1"), ('+1', "'+1"), ('-1', "'-1"), ('@x', "'@x"), ('\t=x', "'\t=x"),
    ('\r', "'\r"), (' =x', "' =x"), ('a;=x', "a;'=x"), ('a;"=x', "a;'\"=x"), ('', ''),
    ('a=1; b - 1', 'a=1; b - 1')])
def test_no_text_of_a_submission_is_a_formula(text, cell):
    assert safe(text) == cell == safe(cell)


# -- a machine that is too busy

@pytest.mark.parametrize('gaps, told, remark', [
    ([0.02], 0, False), ([0.21, 0.02], 1, False), ([0.21, 0.3], 1, True)])
def test_a_machine_that_is_too_busy_is_told(tmp_path, capsys, gaps, told, remark):
    gaps, seen = list(gaps), []

    def tried():
        gap = gaps.pop(0)
        seen[:] = [Marks('Ann', 'lab2/node.py', observation=observation(
            truth=[[t, 0.0, 0.0, 0.0] for t in (0.0, gap, gap + 0.02)]))]
        return seen[0]
    marking, found = marked(tmp_path, {'Ann': tried}, [])
    marking.mark_all(found, 1)
    assert capsys.readouterr().out.count('the machine held the robot up for 0.21 s; tried again') == told
    assert gaps == [] and any('may be unfair' in said for said in seen[0].remarks) is remark


# -- names

@pytest.mark.parametrize('name, words', [
    ('miller', 'no submission is called miller; near it: Ann Miller'),
    ('Bo Laeds', 'near it: Bo Leeds'), ('xyz', 'these are: Ann Miller, Bo Lee, Bo Leeds')])
def test_students_are_chosen_by_name(name, words):
    students = ['Ann Miller', 'Bo Lee', 'Bo Leeds']
    assert chosen(students, ['bo lee', 'Ann Miller']) == ['Bo Lee', 'Ann Miller']
    with pytest.raises(ValueError, match=words):
        chosen(students, [name])
