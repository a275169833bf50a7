"""Counts the tests that scripts/test.sh ran: each case once, by the results of pytest and rostest.

Usage: count_results.py FOLDER CTEST_STATUS LINT LOG

FOLDER holds the result files, CTEST_STATUS is ctest's exit status, LINT is passed, failed or none,
LOG is ctest's output. Prints the failures, the slowest tests, what was tried again on a busy machine, the
reasons of skipped tests, and
last `N passed, N failed(, N skipped)`. The exit status is 0 only if nothing failed and something ran.
"""
import pathlib
import re
import sys
import xml.etree.ElementTree as ET
from collections import Counter

#: Number of the slowest tests that are listed.
SLOWEST = 10
#: These lines of a failure's text are shown, from its beginning and from its end, each to this column.
FIRST, LAST, COLUMN = 6, 18, 200
#: A test in ctest's output: name, seconds.
CTEST = re.compile(r'Test +#\d+: _ctest_tb3_labs_(?:pytest|rostest)_(\S+) .*? +([\d.]+) sec')


def outcomes(file):
    """Yields (outcome, name, text) of each case in a result file."""
    try:
        results = ET.parse(str(file)).getroot()
    except ET.ParseError as error:
        yield 'failed', 'unreadable result', str(error)
        return
    cases = list(results.iter('testcase'))
    # test/ros/rosunit_internals.py prints these lines
    for line in re.findall('(?m)^once more: (.*)', results.findtext('system-out') or ''):
        yield 'repeated', line[:COLUMN], ''
    if not cases:
        yield 'failed', 'no test ran', ''
    for case in cases:
        bad = [result for result in case if result.tag in ('failure', 'error')]
        name = '{}.{}'.format(case.get('classname', ''), case.get('name', ''))
        if bad:
            yield 'failed', name, '{}\n{}'.format(bad[0].get('message') or '', bad[0].text or '')
        elif case.find('skipped') is not None:
            yield 'skipped', name, case.find('skipped').get('message') or 'without a reason'
        # A test node's own cases are in rosunit-NODE.xml; rostest-FILE.xml only says whether each
        # node ended in time.
        elif not file.stem.startswith('rostest-'):
            yield 'passed', name, ''


def main(folder, ctest_status, lint, log):
    """Count, print, and return the exit status."""
    found = [(file.stem, *outcome) for file in sorted(pathlib.Path(folder).rglob('*.xml'))
             for outcome in outcomes(file)]
    if not found:
        found.append(('ctest', 'failed', 'no test ran', ''))
    elif ctest_status != '0' and not any(outcome == 'failed' for _, outcome, _, _ in found):
        found.append(('ctest', 'failed', 'ended with {}; see the full output'.format(
            ctest_status), ''))    # such as a crash at the end
    if lint != 'none':
        found.append(('catkin_lint', lint, 'see above', ''))
    for test, outcome, case, text in found:
        if outcome == 'failed':
            print('\nFAILED {}: {}'.format(test, case))
            lines = text.strip().splitlines()
            if len(lines) > FIRST + LAST:
                lines[FIRST:-LAST] = ['...']
            print(''.join('  | {}\n'.format(line[:COLUMN]) for line in lines))
    times = CTEST.findall(pathlib.Path(log).read_text(errors='replace'))
    if times:
        print('\nslowest:')
    for name, seconds in sorted(times, key=lambda test: -float(test[1]))[:SLOWEST]:
        print('{:6.1f} s  {}'.format(float(seconds), name))
    for _, outcome, case, _ in found:
        if outcome == 'repeated':
            print('tried again: ' + case)
    for reason, number in Counter(text for _, outcome, _, text in found
                                  if outcome == 'skipped').most_common():
        print('skipped: {:3} x {}'.format(number, reason))
    count = Counter(outcome for _, outcome, _, _ in found)
    print('{} passed, {} failed{}'.format(
        count['passed'], count['failed'],
        ', {} skipped'.format(count['skipped']) if count['skipped'] else ''))
    return 1 if count['failed'] else 0


if __name__ == '__main__':
    sys.exit(main(*sys.argv[1:]))
