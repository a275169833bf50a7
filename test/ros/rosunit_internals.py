"""The results of a rostest that may skip a test.

rosunit (1.15 to 1.17) writes a skipped test into its file as one that passed, and
test/count_results.py counts from that file. Each test that skips is run by :func:`rosrun`.
"""
import unittest
import xml.etree.ElementTree as ET

import rospkg
import rostest
from rosunit import xmlrunner

#: Decorator of a test, or a case, that starts scripts/setup.sh. In a workspace of one's own that
#: would install packages, and make a second workspace within the sources.
needs_setup = unittest.skipUnless(
    rospkg.RosPack().get_path('tb3_labs').endswith('/build/.ws/src/tb3_labs'),
    'starts scripts/setup.sh, which this workspace does without: ./scripts/test.sh')


class _Result(xmlrunner._XMLTestResult):
    """rosunit's, with the reason of each skipped test."""

    def xml(self, *words):
        tree = super().xml(*words)
        reasons = {test.id(): reason for test, reason in self.skipped}
        for case in tree.iter('testcase'):
            name = '{}.{}'.format(case.get('classname'), case.get('name'))
            if name in reasons:
                ET.SubElement(case, 'skipped', message=reasons[name])
        return tree


def rosrun(name, case):
    """As rostest.rosrun, for a test of this package."""
    xmlrunner._XMLTestResult = _Result
    rostest.rosrun('tb3_labs', name, case)
