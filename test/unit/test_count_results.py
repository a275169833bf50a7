"""scripts/test.sh counts the results of the tests. Rostests write their results."""
import pathlib
import re
import sys
import unittest
from contextlib import suppress
from unittest import mock

import pytest

TEST = pathlib.Path(__file__).resolve().parents[1]
from count_results import main

PASSED = '<testcase classname="C" name="a"/>'
SKIPPED = '<testcase classname="C" name="b"><skipped message="no screen"/></testcase>'
FAILED = '<testcase classname="C" name="c"><failure message="no"/></testcase>'
ERROR = '<testcase classname="C" name="d"><error message="oh"/></testcase>'
NODE = '<testcase name="testx"/>'


def suite(*cases):
    return '<testsuite>{}</testsuite>'.format(''.join(cases))


@pytest.fixture
def run(tmp_path, capsys):
    """Returns a function that counts result files {name: text}. It returns (exit status, lines)."""
    def count(files, status='0'):
        for name, text in files.items():
            (tmp_path / (name + '.xml')).write_text(text)
        log = tmp_path / 'log'
        log.touch()
        return main(str(tmp_path), status, str(log)), capsys.readouterr().out.splitlines()
    return count


@pytest.mark.parametrize('files, status, last', [
    ({'rostest-test_ros_x': suite(NODE), 'rosunit-x': suite(PASSED, PASSED, SKIPPED),
      'pytest-unit': suite(PASSED)}, '0', '3 passed, 0 failed, 1 skipped'),
    # a file without a case, and files that cannot be read
    *[({'pytest-unit': suite(PASSED), 'rosunit-x': text}, '0', '1 passed, 1 failed')
      for text in (suite(), '', '<testsuite')],
    ({}, '0', '0 passed, 1 failed'), ({}, '8', '0 passed, 1 failed'),    # nothing ran
    # an error; a crash after the last case, and a failure that ctest reports, too
    ({'pytest-unit': suite(PASSED, ERROR)}, '8', '1 passed, 1 failed'),
    ({'pytest-unit': suite(PASSED)}, '8', '1 passed, 1 failed'),
    ({'pytest-unit': suite(FAILED)}, '8', '0 passed, 1 failed')])
def test_each_case_is_counted_once(files, status, last, run):
    ended, lines = run(files, status)
    assert (ended, lines[-1]) == (int(' 0 failed' not in last), last)


def test_no_result_overwrites_another():
    names = [name for file in TEST.glob('*/*.test')
             for name in re.findall(r'test-name="([^"]*)"', file.read_text(encoding='utf-8'))]
    assert names and len(names) == len(set(names))


def test_a_rostest_reports_skipped_and_broken_tests(tmp_path, run, monkeypatch):
    from rosunit_internals import rospy, rosrun, xmlrunner

    class Some(unittest.TestCase):
        def test_one(self):
            pass

        def test_two(self):
            self.skipTest('no screen & no mouse')

    @unittest.skip('no sandboxes')
    class All(unittest.TestCase):
        def test_three(self):
            raise AssertionError

    class Never(unittest.TestCase):
        setUpClass = classmethod(lambda cls: 1 / 0)

        def test_four(self):
            pass

    monkeypatch.setattr(rospy, 'signal_shutdown', lambda reason: None)
    monkeypatch.setattr(xmlrunner, '_XMLTestResult', None)
    for case in Some, All, Never:
        monkeypatch.setattr(sys, 'argv', ['', '--gtest_output=xml:{}/rosunit-{}.xml'.format(
            tmp_path, case.__name__)])
        with suppress(SystemExit):
            rosrun('x', case)
    _, lines = run({})
    assert any(line.startswith('FAILED rosunit-Never: setUpClass ') for line in lines)
    assert lines[-3:] == ['skipped:   1 x no sandboxes', 'skipped:   1 x no screen & no mouse',
                          '1 passed, 1 failed, 2 skipped']


@pytest.mark.parametrize('load, attempts', [(0.0, 1), (1000.0, 3)])
def test_a_rostest_that_fails_is_tried_again_on_a_busy_machine_alone(monkeypatch, load, attempts):
    import rosunit_internals
    ran = []
    monkeypatch.setattr(rosunit_internals.os, 'getloadavg', lambda: (load,))

    class Some(unittest.TestCase):
        hiccups = mock.Mock(longest=lambda begun: 0.0)

        def test_one(self):
            ran.append(1)
            self.assertIn('x', 'page ' * 10000)

    test = rosunit_internals.tried_again(Some.test_one)
    with pytest.raises(AssertionError) as failure:
        test(Some('test_one'))
    assert len(ran) == attempts and len(str(failure.value)) < 4000
