#!/usr/bin/env python3
"""Counts the tests that scripts/test.sh ran: each case once, by the results of pytest and rostest.

Usage: count_results.py FOLDER CTEST_STATUS LINT LOG

FOLDER holds the result files, CTEST_STATUS is ctest's exit status, LINT is passed, failed or none,
LOG is ctest's output. Prints the failures, the slowest tests, and last `N passed, N failed(, N
skipped)`. The exit status is 0 only if nothing failed and something ran.
"""
import pathlib
import re
import sys
import xml.etree.ElementTree as ET

#: Number of the slowest tests that are listed,
SLOWEST = 10
#: and of the last lines of a failure's text that are shown.
LINES = 20
#: A test in ctest's output: kind, name, outcome, seconds.
CTEST = re.compile(r'Test +#\d+: _ctest_tb3_labs_(pytest|rostest)_(\S+) \.*(.*?) +([\d.]+) sec')


class Count:
    """The counts in the result files in `folder` and in ctest's output `log` (a text)."""

    def __init__(self, folder, log):
        self.passed = self.skipped = 0
        #: [(test, case, text)] of all failures.
        self.failures = []
        self._nodes_of = {}        # rostest's result file -> its test nodes' result files
        for file in sorted(pathlib.Path(folder).rglob('*.xml')):
            self._count_file(file)
        self._tests = CTEST.findall(log)
        self._find_unexplained()

    def fail(self, test, case, text=''):
        """Note one failure."""
        self.failures.append((test, case, text))

    def slowest(self):
        """[(seconds, name)] of the tests that took longest, the longest first."""
        return sorted(((float(seconds), name) for _, name, _, seconds in self._tests),
                      reverse=True)[:SLOWEST]

    def _count_file(self, file):
        try:
            cases = list(ET.parse(str(file)).getroot().iter('testcase'))
        except ET.ParseError as error:
            self.fail(file.stem, 'unreadable result', str(error))
            return
        if not cases:
            self.fail(file.stem, 'no test ran')
        # A test node's own cases are in rosunit-NODE.xml; rostest-FILE.xml only says whether each
        # node ended in time.
        is_rostest = file.stem.startswith('rostest-')
        for case in cases:
            if is_rostest:
                self._note_node(file.stem, case.get('name', ''))
            bad = [result for result in case if result.tag in ('failure', 'error')]
            if bad:
                name = '{}.{}'.format(case.get('classname', ''), case.get('name', ''))
                self.fail(file.stem, name, '{}\n{}'.format(bad[0].get('message') or '',
                                                           bad[0].text or ''))
            elif any(result.tag == 'skipped' for result in case):
                self.skipped += 1
            elif not is_rostest:
                self.passed += 1

    def _note_node(self, test, case):
        result = 'rosunit-' + re.sub('^test', '', case)
        if any(result in results for results in self._nodes_of.values()):
            self.fail(test, case, 'this test-name is in two .test files: one result overwrites the '
                                  'other')
        self._nodes_of.setdefault(test, []).append(result)

    def _find_unexplained(self):
        """Note failures of ctest that no result file explains, such as a crash at the end."""
        explained = {test for test, _, _ in self.failures}
        for kind, name, outcome, _ in self._tests:
            test = '{}-{}'.format(kind, re.sub(r'\.test$', '', name))
            if outcome.startswith('***') and not explained.intersection(
                    [test] + self._nodes_of.get(test, [])):
                self.fail(test, 'ended badly; see the full output')


def report(count):
    """The lines to print."""
    lines = []
    for test, case, text in count.failures:
        lines += ['', 'FAILED {}: {}'.format(test, case)]
        lines += ['  | ' + line for line in text.strip().splitlines()[-LINES:]]
    slowest = count.slowest()
    if slowest:
        lines += ['', 'slowest:'] + ['{:6.1f} s  {}'.format(*test) for test in slowest]
    lines.append('{} passed, {} failed{}'.format(
        count.passed, len(count.failures),
        ', {} skipped'.format(count.skipped) if count.skipped else ''))
    return lines


def main(folder, ctest_status, lint, log):
    """Count, print, and return the exit status."""
    count = Count(folder, pathlib.Path(log).read_text(errors='replace'))
    if ctest_status != '0' and not count.failures:
        count.fail('ctest', 'ended with {}; see the full output'.format(ctest_status))
    if not (count.failures or count.passed or count.skipped):
        count.fail('ctest', 'no test ran')
    count.passed += lint == 'passed'
    if lint == 'failed':
        count.fail('catkin_lint', 'failed; see above')
    print('\n'.join(report(count)))
    return 1 if count.failures else 0


if __name__ == '__main__':
    sys.exit(main(*sys.argv[1:]))
