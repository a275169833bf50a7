"""Counts the tests that scripts/test.sh ran: each case once, by the results of pytest and rostest.

Usage: count_results.py FOLDER CTEST_STATUS LOG

FOLDER has the result files. CTEST_STATUS is the exit status of ctest, and LOG its output. Prints the
failures, the slowest tests, the repeated tests, the reasons of skipped tests, and last
`N passed, N failed(, N skipped)`. The exit status is 0 only if nothing failed and something ran.
"""
import pathlib
import re
import sys
import xml.etree.ElementTree as ET
from collections import Counter

#: This number of the slowest tests is listed.
SLOWEST = 10
#: This number of first lines and of last lines of a failure is printed, each up to this column.
FIRST, LAST, COLUMN = 6, 18, 200
#: A line of ctest's output, with the name of a test and its time [s].
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
        # rosunit-NODE.xml has the cases of a node. rostest-FILE.xml has only whether it ended in time.
        elif not file.stem.startswith('rostest-'):
            yield 'passed', name, ''


def main(folder, ctest_status, log):
    """Count, print, and return the exit status."""
    found = [(file.stem, *outcome) for file in sorted(pathlib.Path(folder).rglob('*.xml'))
             for outcome in outcomes(file)]
    has_failed = any(outcome == 'failed' for _, outcome, _, _ in found)
    if not found:
        found.append(('ctest', 'failed', 'no test ran', ''))
    elif ctest_status != '0' and not has_failed:    # such as a crash after the last case
        found.append(('ctest', 'failed', f'ended with {ctest_status}; see the full output', ''))
    for test, outcome, case, text in found:
        if outcome == 'failed':
            print(f'\nFAILED {test}: {case}')
            lines = text.strip().splitlines()
            if len(lines) > FIRST + LAST:
                lines[FIRST:-LAST] = ['...']
            print(''.join(f'  | {line[:COLUMN]}\n' for line in lines))
    times = CTEST.findall(pathlib.Path(log).read_text(errors='replace'))
    if times:
        print('\nslowest:')
    slowest = sorted([(float(seconds), name) for name, seconds in times], reverse=True)[:SLOWEST]
    for seconds, name in slowest:
        print(f'{seconds:6.1f} s  {name}')
    for _, outcome, case, _ in found:
        if outcome == 'repeated':
            print('tried again: ' + case)
    reasons = Counter(text for _, outcome, _, text in found if outcome == 'skipped')
    for reason, number in reasons.most_common():
        print(f'skipped: {number:3} x {reason}')
    count = Counter(outcome for _, outcome, _, _ in found)
    skipped = f', {count["skipped"]} skipped' if count['skipped'] else ''
    print(f'{count["passed"]} passed, {count["failed"]} failed{skipped}')
    return 1 if count['failed'] else 0


if __name__ == '__main__':
    sys.exit(main(*sys.argv[1:]))
