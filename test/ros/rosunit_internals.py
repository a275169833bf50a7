"""Runs the tests of a rostest. A skipped test counts as skipped. A test that fails on a busy machine is tried again.

rosunit (1.15 to 1.17) writes a skipped test into its file as a passed test, and test/count_results.py counts the tests
of this file. On a busy machine a test may fail because a robot, a sender or a node waits for a processor.
:func:`rosrun` runs each test of this package.
"""
import functools
import importlib
import os
import threading
import time
import unittest
import xml.etree.ElementTree as ET
from collections import deque

import rospkg
import rospy
import rostest
from rosunit import xmlrunner

from tb3_labs.ros.node import exit_process

#: Decorator of a test, or a case, that starts scripts/setup.sh. In a workspace of one's own that
#: would install packages, and make a second workspace within the sources.
needs_setup = unittest.skipUnless(
    rospkg.RosPack().get_path('tb3_labs').endswith('/build/.ws/src/tb3_labs'),
    'starts scripts/setup.sh, which this workspace does without: ./scripts/test.sh')


class _Result(xmlrunner._XMLTestResult):
    """Adds the reason of each skipped test, and of a class whose set-up failed, to the class of rosunit."""

    def addError(self, test, err):
        super().addError(test, err)
        if not isinstance(test, unittest.TestCase):
            self._start_time = time.time()
            self.stopTest(test)

    def xml(self, *words):
        tree = super().xml(*words)
        reasons = {test.id(): reason for test, reason in self.skipped}
        for case in tree.iter('testcase'):
            name = '{}.{}'.format(case.get('classname'), case.get('name'))
            if name in reasons:
                ET.SubElement(case, 'skipped', message=reasons[name])
        return tree


#: A test is tried this often. A failure shows this many characters of its beginning and of its end.
ATTEMPTS, SHOWN = 3, 1500
#: A test is void if a thread that sleeps was woken later than this [s],
LATE = 0.1
#: or if more than this number of processes wanted each core in the last minute.
LOAD = 2.0


class Hiccups:
    """Measures the delays of this machine in a separate thread.

    A node can react within a limit only while the machine lets the node run. `since(start)` is about the time in which
    processes had to wait, because an idle thread was late, or because more than LOAD processes wanted each core. Tests
    add this time to their limits. On a quiet machine it is a few milliseconds.
    """

    #: The thread sleeps for this long each time [s]. Each time costs 0.3 ms of computing.
    PERIOD = 0.04

    def __init__(self):
        self._late = deque(maxlen=100000)    # (time [s], late by [s])
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self):
        begun, loads = time.time(), open('/proc/loadavg')
        while True:
            time.sleep(self.PERIOD)
            now = time.time()
            loads.seek(0)
            running = int(loads.read().split()[3].partition('/')[0])
            waiting = max(0.0, 1.0 - LOAD * os.cpu_count() / max(1, running))
            self._late.append((now, max(now - begun - self.PERIOD, waiting * (now - begun))))
            begun = now

    def _delays(self, start, end):
        return [late for at, late in list(self._late) if start <= at <= end]

    def since(self, start, end=float('inf')):
        """The sum of delays between two times [s, wall clock], in seconds."""
        return sum(self._delays(start, end))

    def longest(self, start):
        """The longest delay since a time [s, wall clock], in seconds."""
        return max(self._delays(start, float('inf')), default=0.0)


def tried_again(test):
    """Returns a test that tries `test` again if `test` failed on a busy machine, or if the `excuse(begun)` of its case
    gives a reason why it was void. `begun` is the time of its begin [s, monotonic]."""
    @functools.wraps(test)
    def run(case):
        for attempt in range(1, ATTEMPTS + 1):
            begun, steady = time.time(), time.monotonic()
            try:
                return test(case)
            except unittest.SkipTest:
                raise
            except Exception as error:    # any exception; on a quiet machine it is raised again
                words, late, load = str(error), case.hiccups.longest(begun), os.getloadavg()[0]
                if len(words) > 2 * SHOWN:
                    error.args = (words[:SHOWN] + '\n...\n' + words[-SHOWN:],)
                reason = getattr(case, 'excuse', lambda _begun: '')(steady)
                if late > LATE:
                    reason = reason or 'a thread was woken {:.2f} s late'.format(late)
                if load > LOAD * os.cpu_count():
                    reason = reason or 'the load was {:.1f} on {} cores'.format(load, os.cpu_count())
                if not reason or attempt == ATTEMPTS:
                    raise
                print('once more: {}: {}; it failed: {}'.format(
                    case.id(), reason, error), flush=True)
            case.tearDown()
            case.doCleanups()
            case.setUp()
    return run


def rosrun(name, case):
    """Does the work of rostest.rosrun for a test of this package."""
    xmlrunner._XMLTestResult = _Result
    case.hiccups = Hiccups()
    for test in unittest.defaultTestLoader.getTestCaseNames(case):
        setattr(case, test, tried_again(getattr(case, test)))
    rostest.rosrun('tb3_labs', name, case)


def run(name):
    """Run the only class named ...Test of NAME_test.py, as the ROS node NAME_test unless it has
    `IS_NODE = False`."""
    file = importlib.import_module(name + '_test')
    case, = [getattr(file, word) for word in vars(file) if word.endswith('Test')]
    if getattr(case, 'IS_NODE', True):
        rospy.init_node(name + '_test')
        rospy.on_shutdown(threading.Thread(target=exit_process, daemon=True).start)
    rosrun(name, case)
