"""The marks of a term: pages, a table with a person's columns, and results.json. A later run keeps all marks."""
import csv
import gc
import io
import json
import os
import re
import threading
import weakref
import zipfile
from dataclasses import replace
from types import SimpleNamespace

import pytest
import yaml

from recorded_trial import write_trial
from test_marking import TABLE, Strict, handed_in, marks_of, observation, turned
from tb3_labs.marking import marks_folder
from tb3_labs.marking import marks as marks_module
from tb3_labs.marking.intake.archives import digest_of
from tb3_labs.marking.intake.sandbox import NO_SANDBOX_WARNING
from tb3_labs.marking.intake.submissions import Submission, refuse_unknown_names, submissions_in
from tb3_labs.marking.labs import criteria
from tb3_labs.marking.labs.criteria import Outcome, Verdict
from tb3_labs.marking.marks import LABS, Marks, points_of
from tb3_labs.marking.marks_csv import MarksTable
from tb3_labs.marking.marks_folder import MarksFolder, Options, locked
from tb3_labs.marking.trial_runner import TrialRunner
from tb3_labs.report.page.document import safe_cell

import mark
from mark import ClassMarker

FULL = sum(points_of('turn', TABLE).values()) - sum(
    (TABLE['turn'].get('extra') or {}).values())


def rows_of(text):
    return {row['student']: row for row in csv.DictReader(io.StringIO(text.lstrip('\ufeff')))}


def folder_of(path, table=TABLE, lab='turn', parts=(), **options):
    return MarksFolder(path, lab, parts, points_of(lab, table), Options(**options))


def write(folder, student, seen, digest='digest', **more):
    """Write a submission whose trial was the Observation `seen`. Returns its Marks."""
    if seen is not None:
        write_trial(folder.bag(student), seen)
    return folder.write_student(handed_in(student, **more), digest)


@pytest.fixture(scope='module')
def written(tmp_path_factory):
    """(The folder of a class, its notes). The class has a good node, a wrong node of a student with an odd name, a
    crash, and a submission that could not be judged."""
    path = tmp_path_factory.mktemp('written')
    folder = folder_of(path, sandbox=False)
    bobby, crash = turned(81.0), observation()
    bobby.stimuli[0].printed = '<script>alert("x")</script> & so on\n'
    crash.processes[0].ready, crash.processes[0].printed = None, "ImportError: no 'lab2'"
    crash.processes[0].ended_by_itself = True
    write(folder, 'Ann', turned(90.0))
    write(folder, '<xx>=Bobby', bobby, findings=['It did <that>.'], seconds=41.4)
    write(folder, 'Cy', crash)
    write(folder, 'Di', None, unjudged='It lacks cv2.')
    return path, folder.write_overview()[1]


def test_a_students_page_has_what_the_student_may_see_as_text(written):
    text = (written[0] / '<xx>=Bobby.html').read_text(encoding='utf-8')
    page = Strict(text)
    assert '<script>alert("x")</script> & so on' in page.words and 'A "remark", <b>.' in page.words
    assert page.tags.count('script') == 2       # the timeline's data, and its program
    assert '<xx>=Bobby' in page.words and 'xx' not in page.tags
    assert 'that>' not in page.words and 'content="width=device-width' in text
    crash = Strict((written[0] / 'Cy.html').read_text(encoding='utf-8')).words      # once in each table
    assert crash.count('it ended at once: ') == 1 and crash.count('this could not be tried') > 9
    unjudged = Strict((written[0] / 'Di.html').read_text(encoding='utf-8')).words
    assert 'Not judged.' in unjudged and unjudged.count('It lacks cv2.') == 1
    assert ' of {:g} points'.format(FULL) not in unjudged


def test_the_overview_has_the_cells_of_the_table_and_lines_for_the_instructor(written):
    folder, lines = written
    page = (folder / 'overview.html').read_text(encoding='utf-8')
    assert lines == [NO_SANDBOX_WARNING, 'To look at: <xx>=Bobby: It did <that>.',
                     'To look at: Di: Not judged: It lacks cv2.']
    words = Strict(page).words
    assert all(line in words for line in ['Only for the instructor', *lines]) and '<td data-head="short_way">' in page
    assert 'xx' not in Strict(page).tags
    rows = [re.findall('<td[^>]*>(.*?)</td>', row) for row in page.split('<tr>')[2:]]
    table = list(rows_of((folder / 'marks.csv').read_text()).values())
    assert [row[1:3] for row in rows] == [[row['points'] or 'not judged', row['of']] for row in table]
    assert ['class="verdict"' in row[3] for row in rows] == [True, True, True, False]
    other = folder_of(folder / 'other')
    write(other, 'smith', turned(90.0), '')
    assert 'For the instructor' not in other.write_overview()[0].read_text()


def test_points_beyond_the_handout_are_named_beside_the_full_marks():
    left, extra = (Verdict(next(each for each in LABS['turn'].criteria if each.name == name), Outcome.MET, '', 2.0)
                   for name in ('left', 'within_1_deg'))
    marks = Marks('Ann', verdicts=[left, extra])
    assert marks.points_text == '4 of 2 points, 2 of them beyond the handout'
    assert replace(marks, decided_points=1.0).points_text == '1 of 2 points'
    assert replace(marks, verdicts=[left]).points_text == '2 of 2 points'


def test_the_table_and_results_as_gradescope_reads_them(written):
    rows = rows_of((written[0] / 'marks.csv').read_text())
    ann, crash, unjudged = (rows[name] for name in ('Ann', 'Cy', 'Di'))
    assert (ann['left'], ann['extra_within_1_deg'], ann['node']) == ('3', 'no', 'lab2/node.py')
    assert ann['of'] == '{:g}'.format(FULL) and float(ann['points']) > 0
    assert {unjudged[name] for name in ('points', 'starts', 'left', 'extra_within_1_deg')} == {''}
    assert {crash[name] for name in ('points', 'starts', 'left')} == {'0'}
    results = {name: written[0] / 'gradescope' / name / 'results.json' for name in rows}
    assert json.loads(results['Di'].read_text())['tests'] == []
    found = json.loads(results['<xx>=Bobby'].read_text())
    assert (found['visibility'], found['stdout_visibility']) == ('visible', 'hidden')
    assert all(test['visibility'] == 'visible' for test in found['tests'])
    assert [test['number'] for test in found['tests']] == [str(1 + k) for k in range(len(found['tests']))]
    assert found['score'] == pytest.approx(sum(test['score'] for test in found['tests']), abs=0.01)
    assert found['execution_time'] == 41 and 'A "remark"' in found['output']
    assert sum(test['max_score'] for test in found['tests']) == FULL
    tests = {test['name']: test for test in json.loads(results['Ann'].read_text())['tests']}
    left = tests['l turns 90 degrees left']
    assert left['status'] == 'passed' and left['score'] == left['max_score'] > 0
    missed = [test for test in tests.values() if test['status'] == 'failed']
    assert 'see doc/' in missed[0]['output'] and {test['score'] for test in missed} == {0}


def test_a_trial_whose_clock_jumped_is_not_judged_and_is_tried_again(tmp_path):
    folder = folder_of(tmp_path)
    marks = write(folder, 'Ann', observation(truth=[[0.0, 0.0, 0.0, 0.0], [4000.0, 0.0, 0.0, 0.0]]))
    assert marks.unjudged.endswith('clock was set, or the computer slept; type the same command again.')
    folder.write_overview()
    assert folder_of(tmp_path).write_if_unchanged('Ann', 'digest') is None


def test_marks_are_not_written_through_a_link(tmp_path):
    """A new file takes the place of a link. A folder that is a link is refused."""
    mine, marks = tmp_path / 'mine', tmp_path / 'marks'
    mine.write_text('mine')
    (marks / 'logs').mkdir(parents=True)
    for name in ('Ann.html', 'overview.html', 'logs/Ann.marks.json'):
        (marks / name).symlink_to(mine)
    folder = folder_of(marks)
    write(folder, 'Ann', turned(90.0), '')
    folder.write_overview()
    assert mine.read_text() == 'mine' and rows_of((marks / 'marks.csv').read_text())
    (tmp_path / 'link').symlink_to(marks)
    with pytest.raises(OSError, match='link'):
        folder_of(tmp_path / 'link')


@pytest.mark.parametrize('cells, decision', [
    ({'decided': '12,5'}, (12.5, '')), ({'decided': '0', 'reason': 'copied'}, (0.0, 'copied')),
    ({'reason': 'came late'}, (None, 'came late')),
    ({'points': '28', 'decided': '29'}, (29.0, '')), ({'points': '7,0', 'remarks': 'x'}, (None, ''))])
def test_what_a_person_decides_stays_and_is_shown(tmp_path, cells, decision):
    """A person decides in the columns for decisions. The node itself earned 7 points."""
    changed = dict(TABLE, turn={name: 7.0 * (name == 'starts') if name != 'extra' else {
        each: 0.0 for each in points} for name, points in TABLE['turn'].items()})
    folder = folder_of(tmp_path, changed)
    write(folder, 'Ann', turned(90.0))
    folder.write_overview()
    table, rows = tmp_path / 'marks.csv', rows_of((tmp_path / 'marks.csv').read_text())
    assert rows['Ann']['points'] == '7'
    for _ in range(2):      # it stays over later runs
        typed(table, 'Ann', **cells)
        folder = folder_of(tmp_path, changed)
        marks = folder.write_if_unchanged('Ann', 'digest')
        assert (marks.decided_points, marks.decision_reason) == decision
        folder.write_overview()
        rows, cells = rows_of(table.read_text()), {}
    points = 7.0 if decision[0] is None else decision[0]
    page = Strict((tmp_path / 'Ann.html').read_text(encoding='utf-8')).words
    results = json.loads((tmp_path / 'gradescope' / 'Ann' / 'results.json').read_text())
    assert results['score'] == points == float(rows['Ann']['points'])
    assert '{:g} of 7 points.'.format(points) in page
    assert decision[1] in page and decision[1] in results['output']
    assert decision[1] in (tmp_path / 'overview.html').read_text()
    assert ('A person gave these points; the marker gave 7.' in page) is (decision[0] is not None)


def typed(path, whose, move=lambda heads: heads, **cells):
    """A person edits a student's cells in a spreadsheet, and may move columns."""
    rows = rows_of(path.read_text(encoding='utf-8-sig').replace(';', ','))
    rows[whose].update(cells)
    text = io.StringIO()
    writer = csv.DictWriter(text, move(list(rows[whose])), delimiter=';')
    writer.writeheader()
    writer.writerows(rows[name] for name in sorted(rows, reverse=True))
    path.write_text(text.getvalue(), encoding='utf-8-sig')


CHANGED = 'With other points than before: Ann ({}).'
DECIDED = ' A person\'s points belong into the column "decided".'


def test_a_decision_outlives_a_second_one_a_new_submission_and_a_lost_record(tmp_path):
    table = tmp_path / 'marks.csv'
    for student in ('Ann', 'Bo'):
        write(folder_of(tmp_path), student, turned(90.0))
    folder_of(tmp_path).write_overview()
    before = rows_of(table.read_text())['Ann']['points']
    typed(table, 'Ann', decided='8', move=lambda heads: heads[::-1])
    write(folder_of(tmp_path), 'Ann', turned(10.0), 'handed in again')
    for cells, points, change in ({}, '8', before + ', now 8'), ({'decided': '11'}, '11', '8, now 11'), ({}, '11', ''):
        typed(table, 'Ann', **cells)
        assert folder_of(tmp_path).write_overview()[1] == [CHANGED.format(change)] * bool(change)
        assert [rows_of(table.read_text())['Ann'][name] for name in ('points', 'decided')] == [points] * 2
    (tmp_path / 'logs' / 'Ann.marks.json').unlink()
    assert write(folder_of(tmp_path), 'Ann', turned(90.0)).points == 11.0
    folder_of(tmp_path).write_overview()
    typed(table, 'Ann', student='Anne')
    for _ in range(2):
        notes = folder_of(tmp_path).write_overview()[1]
        assert notes[-1] == 'marks.csv has a decision on Anne, of whom there are no marks.'


def test_a_spreadsheet_sees_utf_8_and_a_table_of_older_runs_is_still_read(tmp_path):
    write(folder_of(tmp_path), 'J\xf6rg', turned(90.0))
    table = tmp_path / 'marks.csv'
    for text in ('student,points,of,decided\nJ\xf6rg,1,30,8\n', None):
        if text:
            table.write_text(text, encoding='utf-8')
        folder_of(tmp_path).write_overview()
        assert table.read_bytes().startswith(b'\xef\xbb\xbfstudent,')
        assert rows_of(table.read_text(encoding='utf-8'))['J\xf6rg']['points'] == '8'


@pytest.mark.parametrize('cell', ['99', '-', '0'])
def test_a_number_that_a_person_types_over_the_markers_points_is_told(tmp_path, cell):
    points = marked_once(tmp_path).points
    typed(tmp_path / 'marks.csv', 'Ann', points=cell)
    assert folder_of(tmp_path).write_overview()[1] == [
        CHANGED.format('{}, now {:g}'.format(cell, points)) + DECIDED]
    typed(tmp_path / 'marks.csv', 'Ann', points='{:.1f}'.format(points).replace('.', ','))
    assert folder_of(tmp_path).write_overview()[1] == []     # a spreadsheet writes the same number in another form


@pytest.mark.parametrize('cell', ['many', '-1', 'nan', '1e999'])
def test_a_decision_that_is_no_number_of_points_is_refused(tmp_path, cell):
    marked_once(tmp_path)
    table = tmp_path / 'marks.csv'
    assert table.read_text().count(',,\n') == 1      # of the row: decided, reason
    table.write_text(table.read_text().replace(',,\n', ',{},\n'.format(cell)))
    with pytest.raises(ValueError, match='Ann: decided = .{}. is not valid'.format(cell)):
        folder_of(tmp_path)


def test_columns_and_rows_of_a_person_stay_wherever_they_are():
    """A name that a spreadsheet would take for a formula is found again."""
    ann = marks_of('=Ann', turned(90.0))
    head, row = csv.reader(io.StringIO(MarksTable().renewed_text([ann])))
    note = 'ill in May ' * 20000        # longer than csv takes
    table = [head[:4] + ['note', ''] + head[4:], row[:4] + [note, 'c'] + row[4:], ['mean', '20'], ['mean', '21'],
             ['', 'late:']]
    out = io.StringIO()
    csv.writer(out).writerows(table)
    text = out.getvalue()
    for _ in range(2):      # a person's cells stay, too
        text = MarksTable(text).renewed_text([ann])
        heads, renewed, *others = csv.reader(io.StringIO(text))
        assert (heads, renewed) == (head + ['note', ''], row + [note, 'c'])
        assert [other[:2] for other in others] == [['mean', '20'], ['mean', '21'], ['', 'late:']]


@pytest.mark.parametrize('text', ['student,points,of,note,note\n', 'student,points,of\na,1,2,well done\n'])
def test_a_table_from_which_a_cell_would_be_lost_is_refused(text):
    with pytest.raises(ValueError, match='each column needs a heading of its own in the first row'):
        MarksTable(text)


@pytest.mark.parametrize('text, cell', [
    ('=1+1', "'=1+1"), ('+1', "'+1"), ('-1', "'-1"), ('@x', "'@x"), ('\t=x', "'\t=x"),
    ('\r', "'\r"), (' =x', "' =x"), ('a;=x', "a;'=x"), ('a;"=x', "a;'\"=x"), ('', ''),
    ('a=1; b - 1', 'a=1; b - 1')])
def test_no_text_of_a_submission_is_a_formula(text, cell):
    assert safe_cell(text) == cell == safe_cell(cell)


def marked_once(path, digest='digest'):
    folder = folder_of(path)
    marks = write(folder, 'Ann', turned(90.0), digest)
    folder.write_overview()
    return marks


def test_what_has_not_changed_is_kept(tmp_path):
    marks = marked_once(tmp_path)
    folder = folder_of(tmp_path)
    kept = folder.write_if_unchanged('Ann', 'digest')
    assert replace(kept, observation=None) == replace(marks, observation=None)
    seen = weakref.ref(kept.observation)
    del kept
    gc.collect()
    assert folder and seen() is None        # the observations of a class need hundreds of MB
    bag = tmp_path / 'logs' / 'Ann.bag'
    whole = bag.read_bytes()
    for replace_it in (bag.unlink, lambda: bag.write_bytes(whole[:9000]),
                       lambda: write_trial(bag, observation()), lambda: write_trial(bag, observation('imu'))):
        replace_it()        # nor is another student's his, or another lab's
        assert folder_of(tmp_path).write_if_unchanged('Ann', 'digest') is None
        folder_of(tmp_path).write_overview()
        assert rows_of((tmp_path / 'marks.csv').read_text())['Ann']['points'] == ''
    marked_once(tmp_path)
    assert folder_of(tmp_path).write_if_unchanged('Ann', 'other digest') is None
    assert folder_of(tmp_path).write_if_unchanged('Bo', 'digest') is None
    assert folder_of(tmp_path, pad='xbox').write_if_unchanged('Ann', 'digest') is None
    marked_once(tmp_path, digest='')
    assert folder_of(tmp_path).write_if_unchanged('Ann', 'digest') is None


def test_the_file_that_a_person_chose_for_a_student_stays_chosen(tmp_path):
    """A plain run afterwards keeps the choice; a new choice, or a new submission, is judged."""
    write(folder_of(tmp_path, name='lab2/src/n.py'), 'Ann', turned(90.0))
    assert folder_of(tmp_path, name='').write_if_unchanged('Ann', 'digest')
    assert folder_of(tmp_path, name='').write_if_unchanged('Ann', 'other digest') is None
    assert folder_of(tmp_path, name='lab2/src/m.py').write_if_unchanged('Ann', 'digest') is None
    write(folder_of(tmp_path, name='n.py'), 'Ann', turned(90.0))     # a name is the whole class's
    assert folder_of(tmp_path, name='').write_if_unchanged('Ann', 'digest') is None


def test_a_name_or_package_that_a_person_chose_for_a_student_outlives_a_new_trial_and_a_new_submission(tmp_path):
    def written(digest, is_for_class=True, **options):
        folder = MarksFolder(tmp_path, 'turn', (), points_of('turn', TABLE), Options(**options), is_for_class)
        chosen = folder.options_of('Ann')
        write(folder, 'Ann', turned(90.0), digest)
        return chosen.name, chosen.package
    assert written('1', name='n.py') == ('n.py', '') and written('1') == ('', '')        # the whole class's
    assert written('1', is_for_class=False, name='n.py') == ('n.py', '')
    assert written('1') == written('2') == written('', is_for_class=False) == written('2') == ('n.py', '')
    assert written('2', is_for_class=False, package='my_lab') == ('', 'my_lab') == written('2')
    assert folder_of(tmp_path).options_of('Bo') == Options()


def test_what_a_trial_runs_decides_whether_it_is_kept(tmp_path, monkeypatch):
    """A simulated robot, a check or a script that has changed; not points, criteria, sentences."""
    for name in ('launch/fake_robot.launch', 'launch/checks/points.yaml', 'launch/checks/check_turn.test',
                 'launch/checks/check_imu.test', 'scripts/fake_turtlebot3.py'):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text('1')
    monkeypatch.setattr(marks_folder, 'PACKAGE_FOLDER', tmp_path)
    marked_once(tmp_path / 'marks')
    for name in ('launch/checks/points.yaml', 'launch/checks/check_imu.test'):
        (tmp_path / name).write_text('2')
        assert folder_of(tmp_path / 'marks').write_if_unchanged('Ann', 'digest')
    for name in ('launch/fake_robot.launch', 'launch/checks/check_turn.test',
                 'scripts/fake_turtlebot3.py'):
        (tmp_path / name).write_text('2')
        assert folder_of(tmp_path / 'marks').write_if_unchanged('Ann', 'digest') is None
        marked_once(tmp_path / 'marks')
    names = {path.name for path in marks_folder.trial_files('turn')}
    assert {'simulator.py', 'ros_trial.py', 'ros_turn.py', 'stimuli.py', 'handout.py'} < names
    assert not {'criteria.py', 'remarks.py', 'from_bag.py', 'student_results.py'} & names


def test_new_points_criteria_and_sentences_reach_the_pages_without_another_trial(tmp_path, monkeypatch):
    marks = marked_once(tmp_path)
    page, table = tmp_path / 'Ann.html', tmp_path / 'marks.csv'
    changed = yaml.safe_load(yaml.safe_dump(TABLE))
    changed['turn']['left'] = 13
    folder = folder_of(tmp_path, changed)
    assert folder.write_if_unchanged('Ann', 'digest').points == marks.points + 10
    _, (note,) = folder.write_overview()
    assert note == CHANGED.format('{:g}, now {:g}'.format(marks.points, marks.points + 10)) + DECIDED
    assert '{:g} of {:g} points'.format(marks.points + 10, marks.full_points + 10) in page.read_text()
    assert 'id="timeline"' in page.read_text()
    assert rows_of(table.read_text())['Ann']['of'] == '{:g}'.format(marks.full_points + 10)
    turn = marks_folder.LABS['turn']
    stricter = [criteria.Criterion(
        each.name, each.part, 'turns <quite> well', each.sheet_step, lambda seen: 'it is too slow')
        if each.name == 'left' else each for each in turn.criteria]
    turns = dict(marks_folder.LABS, turn=turn._replace(criteria=stricter))
    for module in (marks_folder, marks_module):
        monkeypatch.setattr(module, 'LABS', turns)
    folder = folder_of(tmp_path, changed)
    assert folder.write_if_unchanged('Ann', 'digest').points == marks.points - 3
    folder.write_overview()
    assert 'turns <quite> well' in Strict(page.read_text()).words
    assert 'it is too slow' in (tmp_path / 'gradescope' / 'Ann' / 'results.json').read_text()
    assert rows_of(table.read_text())['Ann']['left'] == '0'


def test_marks_of_another_lab_are_not_mixed_in(tmp_path):
    marked_once(tmp_path)
    for other in ({'lab': 'imu'}, {'parts': ['mouse']}):
        with pytest.raises(ValueError, match='has marks of turn, all parts: choose another'):
            folder_of(tmp_path, **other)


def test_a_record_that_was_cut_off_and_a_table_that_cannot_be_read(tmp_path):
    marked_once(tmp_path)
    (tmp_path / 'logs' / 'Ann.marks.json').write_text('{"key"')
    assert folder_of(tmp_path).write_if_unchanged('Ann', 'digest') is None
    assert folder_of(tmp_path).write_overview() == (None, [])
    for text, why in (('my own table\n', 'it lacks one of the columns student, points, of'),
                      ('student;points;of;M\xfcller', 'a spreadsheet must save it as "CSV UTF-8"')):
        (tmp_path / 'marks.csv').write_text(text, encoding='latin-1')
        with pytest.raises(ValueError, match='may hold what a person wrote: ' + why):
            folder_of(tmp_path)


def marked(path, acts):
    """(A class whose marker needs no robot, its submissions). `acts` is {student: a function that returns the
    Observation, an exception, or None for a good turn}."""
    folder = folder_of(path / 'marks')
    marker = TrialRunner(folder, threading.Event())

    def try_out(submission, *_):
        act = acts.get(submission.student)
        if isinstance(act, Exception):
            raise act
        write_trial(folder.bag(submission.student), act() if act else turned(90.0))
        return handed_in(submission.student)
    marker.try_out = try_out
    for student in acts:
        (path / 'in' / student).mkdir(parents=True)
        (path / 'in' / student / 'turtlebot_controller.py').write_text('x')
    return ClassMarker(marker, False), submissions_in(path / 'in', print)


def marks_below(path):
    folder_of(path).write_overview()
    return rows_of((path / 'marks.csv').read_text())


ODD = os.fsdecode(b'M\xfcller')


def test_one_odd_submission_does_not_end_the_class(tmp_path, capsys):
    """A name that is not UTF-8, problems in the marking, odd remarks, a trial that cannot be judged, a zip file that
    was cut off: a submission that is not judged gets no zero."""
    with zipfile.ZipFile(str(tmp_path / 'whole.zip'), 'w') as archive:
        archive.writestr('lab2/turtlebot_controller.py', 'x' * 5000)
    (tmp_path / 'in').mkdir()
    (tmp_path / 'in' / 'zip.zip').write_bytes((tmp_path / 'whole.zip').read_bytes()[:3000])
    odd, damaged = turned(90.0), turned(90.0)
    odd.remarks = ['=1+1', '\x1b[2J' + ODD, 'x' * 200000]
    damaged.stimuli[0].facts = {}       # its criterion needs a fact
    unjudged = {'bob': RecursionError('too deep'), 'eve': MemoryError(),
                'cat': UnicodeEncodeError('utf-8', ODD, 1, 2, 'no')}
    acts = dict(unjudged, ann=None, dot=lambda: odd, fay=lambda: damaged, **{ODD: None})
    marking, found = marked(tmp_path, acts)
    assert marking.mark_all(found, 2) is True
    rows = marks_below(tmp_path / 'marks')
    assert set(rows) == {'ann', 'bob', 'cat', 'dot', 'eve', 'fay', 'zip', 'M\\xfcller'}
    unjudged['fay'] = KeyError()
    assert rows['ann']['points'] == rows['M\\xfcller']['points'] != ''
    for student, problem in unjudged.items():
        assert rows[student]['points'] == '' and type(problem).__name__ in rows[student]['remarks']
        assert 'Not judged' in (tmp_path / 'marks' / (student + '.html')).read_text()
    assert '=1+1 \\x1b[2JM\\xfcller' in rows['dot']['remarks']
    assert len(rows['dot']['remarks']) < 5000
    assert capsys.readouterr().err.count('not judged: ') == 3
    said = 'The zip file zip.zip cannot be unpacked: File is not a zip file.'
    assert rows['zip']['points'] == rows['zip']['starts'] == '' and rows['zip']['remarks'] == said
    assert 'To look at: zip: Not judged: ' + said in folder_of(tmp_path / 'marks').write_overview()[1]


def test_marks_that_are_ready_at_an_interruption_are_written(tmp_path, monkeypatch):
    begun, go_on = threading.Event(), threading.Event()

    def slowly():
        begun.set()
        go_on.wait(100.0)
        return turned(90.0)

    def interrupted(tasks, _):
        begun.wait(100.0)
        go_on.set()
        raise KeyboardInterrupt
    marking, found = marked(tmp_path, {'ann': None, 'bob': slowly})
    monkeypatch.setattr(mark, 'wait', interrupted)
    assert marking.mark_all(found, 2) is True
    assert list(marks_below(tmp_path / 'marks')) == ['ann', 'bob']


def test_what_was_marked_and_has_not_changed_is_not_tried_again(tmp_path, capsys):
    marking, found = marked(tmp_path, {'ann': None})
    assert marking.mark_all(found, 1) is False
    before = marks_below(tmp_path / 'marks')
    marker = TrialRunner(folder_of(tmp_path / 'marks'), threading.Event())    # of the next run of mark.py
    marker.try_out = None
    assert ClassMarker(marker, False).mark_all(found, 1) is False
    assert marks_below(tmp_path / 'marks') == before
    assert capsys.readouterr().out.endswith(
        '[1/1] ann: {0[points]} of {0[of]} points, tried before, and not changed\n'.format(before['ann']))
    results = json.loads((tmp_path / 'marks' / 'gradescope' / 'ann' / 'results.json').read_text())
    assert results['score'] == float(before['ann']['points'])
    assert ClassMarker(marker, True).mark_all(found, 1) is True     # --only tries it again, and fails


def test_what_the_preparation_of_a_node_finds_reaches_the_instructor(tmp_path, monkeypatch):
    """The preparation finds, for example, that a first line names a Python which this machine lacks."""
    def prepares(_runner, _marks, reading, *_):
        reading.remarks.append('It was repaired.')
        reading.findings.append('It names another Python.')
    monkeypatch.setattr(TrialRunner, '_record_trial', prepares)
    reading = SimpleNamespace(remarks=['It was read.'], findings=[])
    runner = TrialRunner(folder_of(tmp_path), threading.Event())
    marks = runner.try_out(Submission('Ann', {}), reading, tmp_path)
    assert marks.remarks == ['It was read.', 'It was repaired.'] and marks.findings == ['It names another Python.']


@pytest.mark.parametrize('gaps, remark', [([0.21, 0.02], False), ([0.21, 0.3], True)])
def test_a_machine_that_is_too_busy_is_told(tmp_path, capsys, gaps, remark):
    gaps = list(gaps)

    def tried():
        gap = gaps.pop(0)
        return observation(truth=[[t, 0.0, 0.0, 0.0] for t in (0.0, gap, gap + 0.02)])
    marking, found = marked(tmp_path, {'Ann': tried})
    marking.mark_all(found, 1)
    assert capsys.readouterr().out.count('The machine held the robot up for 0.21 s') == 1
    words = Strict((tmp_path / 'marks' / 'Ann.html').read_text(encoding='utf-8')).words
    assert gaps == [] and ('may be unfair' in words) is remark
    _, notes = folder_of(tmp_path / 'marks').write_overview()
    assert any('Type the same command again.' in note for note in notes) is remark
    kept = folder_of(tmp_path / 'marks').write_if_unchanged('Ann', digest_of(tmp_path / 'in' / 'Ann'))
    assert (kept is None) is remark     # it alone is repeated


def test_full_marks_are_never_unfair():
    held_up = turned(90.0)
    times = held_up.recording.ground_truth.arrival
    times[50:] += 0.5
    marks = marks_of('Ann', held_up)
    assert marks.delay_sentence
    marks.verdicts = [replace(each, outcome=criteria.Outcome.MET) for each in marks.verdicts]
    assert marks.meets_handout and not marks.delay_sentence


def test_two_marks_of_one_folder_are_refused(tmp_path):
    with locked(tmp_path):
        with pytest.raises(ValueError, match='another mark.py writes into .*: wait until it has ended'):
            with locked(tmp_path):
                pass
    with locked(tmp_path):
        pass


STUDENTS = 'Ann Miller', 'Bo Lee', 'Bo Leeds'


@pytest.mark.parametrize('students, name, words', [
    (STUDENTS, 'miller', 'no submission is called miller; these are: Ann Miller, Bo Lee, Bo Leeds'),
    (list(map(str, range(104))), 'Nobody', 'these are: 0, 1, .*, 98, 99 and 4 more')])
def test_the_names_of_a_class_are_listed_for_an_unknown_student(students, name, words):
    with pytest.raises(ValueError, match=words):
        refuse_unknown_names([name], students)
