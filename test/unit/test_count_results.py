"""The lines of scripts/test.sh for result files that are written here."""
import os
import pathlib
import re
import sys
import unittest

import pytest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), os.pardir))
from count_results import LINES, Count, main    # noqa: E402 (it is beside this folder)

CASES = {'passed': '<testcase classname="C" name="a"/>',
         'skipped': '<testcase classname="C" name="b"><skipped/></testcase>',
         'failed': '<testcase classname="C" name="c"><failure message="no">{}</failure></testcase>',
         'error': '<testcase classname="C" name="d"><error message="oh"/></testcase>'}


@pytest.fixture
def results(tmp_path):
    """Writes one result file with the given cases, or with a text."""
    def write(name, *cases, text=None):
        body = ''.join(CASES.get(case, case) for case in cases)
        (tmp_path / (name + '.xml')).write_text(
            '<testsuite>' + body + '</testsuite>' if text is None else text)
        return tmp_path
    return write


def log_line(name, outcome, seconds):
    return ' 3/38 Test #7: _ctest_tb3_labs_{} .....{}   {:.2f} sec\n'.format(name, outcome, seconds)


def run(folder, capsys, status='0', lint='none', log=''):
    """(exit status, lines printed)"""
    file = folder / 'log'
    file.write_text(log)
    return main(str(folder), status, lint, str(file)), capsys.readouterr().out.splitlines()


NODE = '<testcase name="testx"/>'


@pytest.mark.parametrize('files, status, lint, last', [
    ({'rostest-test_ros_x': [NODE], 'rosunit-x': ['passed', 'passed', 'skipped'],
      'pytest-unit': ['passed']}, '0', 'passed', '4 passed, 0 failed, 1 skipped'),
    # a file without a case
    ({'pytest-unit': ['passed'], 'rosunit-x': []}, '0', 'none', '1 passed, 1 failed'),
    # one name in two files
    ({'rostest-test_ros_x': [NODE], 'rostest-test_ros_y': [NODE], 'rosunit-x': ['passed']},
     '0', 'none', '1 passed, 1 failed'),
    # nothing ran
    ({}, '0', 'none', '0 passed, 1 failed'), ({}, '0', 'passed', '1 passed, 1 failed'),
    ({}, '8', 'passed', '1 passed, 1 failed'), ({}, '0', 'failed', '0 passed, 2 failed'),
    ({'pytest-unit': ['passed']}, '0', 'failed', '1 passed, 1 failed')])
def test_the_last_line_counts_every_case_once(files, status, lint, last, results, tmp_path, capsys):
    for name, cases in files.items():
        results(name, *cases)
    ended, lines = run(tmp_path, capsys, status=status, lint=lint)
    assert (ended, lines[-1]) == (int(' 0 failed' not in last), last)


@pytest.mark.parametrize('case', ['failed', 'error'])
def test_a_failure_is_shown_by_its_last_lines(case, results, capsys):
    text = CASES[case].format('\n'.join('line %d' % number for number in range(100)))
    status, lines = run(results('pytest-unit', 'passed', text), capsys, status='8')
    assert (status, lines[-1]) == (1, '1 passed, 1 failed')
    assert any(line.startswith('FAILED pytest-unit: C.') for line in lines)
    shown = [line for line in lines if line.startswith('  | ')]
    assert len(shown) <= LINES and ('line 99' in shown[-1] or shown == ['  | oh'])


def test_the_ten_slowest_come_before_the_last_line(results, capsys):
    log = ''.join(log_line('rostest_test_ros_t%d.test' % number, '   Passed', 1.5 * number)
                  for number in range(12))
    _, lines = run(results('pytest-unit', 'passed'), capsys, log=log)
    begin = lines.index('slowest:')
    assert lines[begin + 1] == '  16.5 s  test_ros_t11.test'
    assert lines[begin + 10] == '   3.0 s  test_ros_t2.test'
    assert lines[begin + 11:] == ['1 passed, 0 failed']


@pytest.mark.parametrize('outcome', ['***Failed', '***Timeout', '***Exception: SegFault',
                                     '***Not Run'])
def test_what_ctest_alone_calls_failed_is_a_failure(outcome, results):
    folder = results('rosunit-x', 'passed')
    count = Count(folder, log_line('rostest_test_ros_x.test', outcome, 3.0))
    assert [test for test, _, _ in count.failures] == ['rostest-test_ros_x']


@pytest.mark.parametrize('name, result', [
    ('pytest_unit', 'pytest-unit'), ('rostest_test_ros_x.test', 'rosunit-x')])
def test_a_failure_that_a_result_file_explains_counts_once(name, result, results):
    results('rostest-test_ros_x', NODE)
    count = Count(results(result, 'failed'), log_line(name, '***Failed', 3.0))
    assert [test for test, _, _ in count.failures] == [result]


@pytest.mark.parametrize('text', ['', '<testsuite'])
def test_a_result_file_that_cannot_be_read_is_a_failure(text, results, capsys):
    results('pytest-unit', 'passed')
    status, lines = run(results('rosunit-x', text=text), capsys)
    assert (status, lines[-1]) == (1, '1 passed, 1 failed')


def test_a_rostest_that_skips_says_so(tmp_path, capsys, monkeypatch):
    rospy, xmlrunner = pytest.importorskip('rospy'), pytest.importorskip('rosunit.xmlrunner')
    monkeypatch.syspath_prepend(str(pathlib.Path(__file__).parents[1] / 'ros'))
    from rosunit_internals import rosrun

    class Some(unittest.TestCase):
        def test_one(self):
            pass

        def test_two(self):
            self.skipTest('no screen & no mouse')

        @unittest.skip('never')
        def test_three(self):
            raise AssertionError

    monkeypatch.setattr(rospy, 'signal_shutdown', lambda reason: None)
    monkeypatch.setattr(xmlrunner, '_XMLTestResult', None)
    monkeypatch.setattr(sys, 'argv', ['', '--gtest_output=xml:{}/rosunit-x.xml'.format(tmp_path)])
    rosrun('x', Some)
    assert run(tmp_path, capsys)[1][-1] == '1 passed, 0 failed, 2 skipped'


def test_each_rostest_that_may_skip_says_so():
    files = sorted((pathlib.Path(__file__).parents[1] / 'ros').glob('*_test.py'))
    texts = {file.name: file.read_text(encoding='utf-8') for file in files}
    assert texts and [name for name, text in texts.items() if 'rostest.rosrun(' in text
                      and re.search('skip(Test|If|Unless)', text)] == []
