"""The words of a check on the criteria, and on a node that cannot be started."""
import io
import unittest
import xml.etree.ElementTree as ElementTree

import pytest
import rosunit

from tb3_labs.marking.labs.criteria import Criterion, Outcome, Verdict
from tb3_labs.marking.marks import Marks
from tb3_labs.watch.mistake import SheetStep

import check_lab
from check_lab import checks_of, file_of


def verdict(name, outcome, worth=2.0, extra=False):
    criterion = Criterion(name, 'turns', name + 's well', SheetStep('imu_lab.md', 'Lab', 4), lambda seen: '', extra)
    seen = '' if outcome is Outcome.MET else 'it fell'
    return Verdict(criterion, outcome, seen, worth)


MET, MISSED, NOT_OFFERED = Outcome.MET, Outcome.MISSED, Outcome.NOT_OFFERED


@pytest.mark.parametrize('made, line', [
    (verdict('turn', MET), '  met          2 of 2    turns well'),
    (verdict('turn', MISSED),
     '  NOT MET      0 of 2    turns well: it fell; see doc/imu_lab.md, "Lab", step 4'),
    (verdict('turn', NOT_OFFERED, 0.5),
     '  NOT OFFERED  0 of 0.5  turns well: it fell; see doc/imu_lab.md, "Lab", step 4'),
    (verdict('turn', MISSED, 0.0, extra=True),
     '  not yet      extra     turns well: it fell; see doc/imu_lab.md, "Lab", step 4'),
    (verdict('turn', MET, 1.0, extra=True), '  met          1 of 1    turns well')])
def test_a_verdict_is_one_line(made, line):
    assert made.line == line


def results(marks, strict):
    """Returns {test: text of its failure, or None} from the file that rostest reads."""
    file = io.StringIO()
    runner = rosunit.xmlrunner.XMLTestRunner(file)
    runner.run(unittest.TestSuite(checks_of(marks, strict)))
    suite = ElementTree.fromstring(file.getvalue())
    return {case.get('name'): case.findtext('failure') for case in suite.iter('testcase')}


def test_rostest_gets_a_sentence_for_each_criterion_that_is_not_met_and_the_total():
    marks = Marks('', verdicts=[
        verdict('turn', MET), verdict('drive', MISSED, 3.0), verdict('rest', NOT_OFFERED, 0.0, extra=True),
        verdict('end', MET, 1.0, extra=True)])
    told = results(marks, strict=False)
    # a missed criterion beyond the handout is no test
    assert list(told) == ['test_turn', 'test_drive', 'test_extra_end', 'test_total']
    assert told['test_turn'] is told['test_extra_end'] is None
    assert told['test_drive'].strip() == (
        'NOT MET      0 of 3    drives well: it fell; see doc/imu_lab.md, "Lab", step 4')
    assert told['test_total'].strip() == '3 of 5 points, 1 of them beyond the handout'
    assert results(marks, strict=True)['test_extra_rest'].startswith('not offered')
    good = Marks('', verdicts=[verdict('turn', MET), verdict('rest', MISSED, 0.0, extra=True)])
    assert results(good, strict=False) == {'test_turn': None, 'test_total': None}


def test_why_nothing_was_judged_is_told_once(monkeypatch, capsys):
    def refuse():
        raise ValueError('no node')
    told = []
    monkeypatch.setattr(check_lab, 'run_trial_and_judge', refuse)
    monkeypatch.setattr(check_lab, 'report', lambda checks: told.extend(check._failure for check in checks))
    monkeypatch.setattr(check_lab.rospy, 'init_node', lambda name: None)
    check_lab.main()
    assert told == ['nothing was judged: no node'] and capsys.readouterr() == ('', '')


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A package with one node that rosrun can start, and others that it cannot start."""
    (tmp_path / 'package.xml').write_text('<package><name>lab_of_test</name></package>')
    for name, mode in (('good.py', 0o755), ('plain.py', 0o644), ('src/two.py', 0o755),
                       ('scripts/two.py', 0o755)):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text('#!/usr/bin/env python3\n')
        (tmp_path / name).chmod(mode)
    monkeypatch.setenv('ROS_PACKAGE_PATH', str(tmp_path))
    return tmp_path


def test_the_file_that_rosrun_starts_is_named(package):
    assert file_of('lab_of_test', 'good.py') == str(package / 'good.py')


@pytest.mark.parametrize('name, node, words', [
    ('lab_of_test', 'plain.py', "they're either not files, or not executable: {}/plain.py. Type: chmod +x FILE"),
    ('lab_of_test', 'two.py', 'two.py. Give each file its own name, or source only one workspace.'),
    ('lab_of_test', 'x', "Couldn't find executable named x below {}"),
    ('lab_of_tset', 'good.py', "package 'lab_of_tset' not found. Build its workspace, and type: ")])
def test_a_node_that_rosrun_cannot_start_is_told(name, node, words, package):
    with pytest.raises(ValueError) as refused:
        file_of(name, node)
    assert words.format(package) in str(refused.value)
