#!/usr/bin/env python3
"""Checks a node by the criteria of its lab. The rostest reports a test for each criterion, and a
test for the total.

The terminal shows the stimuli, the verdicts and the points. If `~strict` is false, the criteria
beyond the handout cannot fail a test.

Started by check_LAB.test. Parameters
    ~lab        imu, turn, move2goal or gamepad.
    ~pkg        The package of the node.
    ~type       The file of the node.
    ~node       finished, or plain for the file plain_TYPE. Only for nodes of this package.
    ~points     A YAML file with the points of each criterion.
    ~parts      Parts of the lab, separated by commas; empty for all parts.
    ~record     The path of the trial's bag; empty if the bag is not kept.
    ~pad        NAME of launch/params/pad_NAME.yaml. Only for the lab gamepad.
    ~strict     May a criterion beyond the handout fail a test?
    ~wrong_argument     A sentence about a wrong argument of rostest, or ''.
"""
import os
import re
import subprocess
import sys
import tempfile
import unittest

import rospy
import rosunit

from tb3_labs.marking.labs.criteria import Outcome
from tb3_labs.marking.labs.gamepad import HANDOUT_PAD, pad_called
from tb3_labs.marking.marks import LABS, Marks, marks_after_trial, points_of, read_points
from tb3_labs.marking.student_nodes import GAMEPAD, OWN_PACKAGE, NodeStart
from tb3_labs.marking.trial.from_bag import read_trial
from tb3_labs.marking.trial.ros_trial import record_trial
from tb3_labs.ros.node import begin_shutdown, exit_process

FINISHED = 'finished'
XML_OPTION = '--gtest_output=xml:'    # rostest adds the path of the results file to this option
#: {words in a message of rosrun: what the student can do}
REMEDIES = {'not executable': 'Type: chmod +x FILE',
            'not found': 'Build its workspace, and type: source devel/setup.bash',
            'non-unique': 'Give each file its own name, or source only one workspace.'}


def run_trial_and_judge():
    """Test the node in a trial. Returns the node's Marks. Returns None if mark.py started this
    check, because mark.py itself judges the bag of the trial."""
    parameters = rospy.get_param('~')
    if parameters['wrong_argument']:
        raise ValueError(parameters['wrong_argument'])
    lab_name, package, executable = parameters['lab'], parameters['pkg'], parameters['type']
    node = parameters.get('node', FINISHED)
    if package == OWN_PACKAGE and node != FINISHED:
        executable = f'{node}_{executable}'

    lab = LABS[lab_name]
    parts = lab.read_parts(parameters['parts'])
    # a student's node must not be able to read these parameters
    for private_name in ('lab', 'points', 'parts', 'record', 'wrong_argument'):
        rospy.delete_param('~' + private_name)
    criterion_points = points_of(lab_name, read_points(parameters['points']))
    pad = pad_called(parameters.get('pad', HANDOUT_PAD))
    if lab_name == GAMEPAD:
        rospy.set_param('/' + GAMEPAD, pad)     # for the finished node of this package

    if package == OWN_PACKAGE:
        print_line('This is the node of this package. For yours: pkg:=PACKAGE type:=FILE')
    marked_program = NodeStart.from_environment().program
    print_line(f"{lab.title}, {', '.join(parts or lab.parts)}: {package}/{executable} is judged, "
               f'{marked_program or file_of(package, executable)}')

    with tempfile.TemporaryDirectory() as folder:
        bag_path = parameters['record'] or os.path.join(folder, 'trial.bag')
        record_trial(lab_name, package, executable, parts, bag_path, pad, print_line)
        if marked_program:
            return None
        return marks_after_trial(
            Marks(''), read_trial(bag_path), lab_name, criterion_points, parts)


def print_line(line):
    """Print a line on standard error, which the terminal shows without a delay."""
    print(line, file=sys.stderr, flush=True)


def file_of(package, executable):
    """Returns the path of the file that ``rosrun PACKAGE FILE`` starts. If rosrun does not find
    exactly one program, raises ``ValueError`` with rosrun's message and a remedy."""
    rosrun = subprocess.run(['rosrun', '--prefix', 'echo', package, executable],
                            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                            stderr=subprocess.STDOUT, universal_newlines=True)
    printed = rosrun.stdout.strip()
    if os.path.isfile(printed):
        return printed
    message = re.sub(r'(\s|\[rosrun\]|#\?)+', ' ', printed).strip()
    remedies = [remedy for words, remedy in REMEDIES.items() if words in message]
    raise ValueError('. '.join([message, *remedies]))


class Check(unittest.TestCase):
    """A test whose result is known already. `failure` is the reason, or '' if the test passes."""

    def __init__(self, name, failure=''):
        super().__init__()
        self._name = name
        self._failure = failure

    def runTest(self):
        pass    # unittest requires this method, but run() below does not call it

    def id(self):
        return 'check_lab.Check.' + self._name

    def __str__(self):
        return self._name

    def run(self, result=None):
        result.startTest(self)
        if self._failure:
            result.addFailure(self, (AssertionError, AssertionError(self._failure), None))
        else:
            result.addSuccess(self)
        result.stopTest(self)
        return result


def checks_of(marks, is_strict):
    """Returns a Check for each criterion, and one for the total. If `is_strict` is false, the
    criteria beyond the handout that are not met are left out, because their tests would fail."""
    checks = []
    for verdict in marks.verdicts:
        is_met = verdict.outcome is Outcome.MET
        may_fail_test = is_strict or not verdict.criterion.is_extra
        if is_met or may_fail_test:
            failure = '' if is_met else verdict.line.strip()
            checks.append(Check('test_' + verdict.criterion.label, failure))
    failure = '' if marks.meets_handout else marks.points_text
    return [*checks, Check('test_total', failure)]


def report(checks):
    """Report the results of `checks` to rostest. Returns the exit status."""
    if '--text' in sys.argv:
        runner = unittest.TextTestRunner(verbosity=2)
    else:
        paths = [word[len(XML_OPTION):] for word in sys.argv if word.startswith(XML_OPTION)]
        runner = rosunit.create_xml_runner(OWN_PACKAGE, 'check', paths[0] if paths else None)
    result = runner.run(unittest.TestSuite(checks))
    return 0 if result.wasSuccessful() else 1


def main():
    rospy.init_node('check')
    try:
        marks = run_trial_and_judge()
    except (OSError, ValueError) as error:
        return report([Check('test_runs', f'nothing was judged: {error}')])
    if marks is None:
        return report([])
    lines = [verdict.line for verdict in marks.graded_verdicts]
    lines += filter(None, [*marks.remarks, marks.hint, marks.points_text])
    if marks.extra_verdicts:
        lines += ['Beyond the handout:', *(verdict.line for verdict in marks.extra_verdicts)]
    for line in lines:
        print_line(line)
    return report(checks_of(marks, rospy.get_param('~strict')))


if __name__ == '__main__':
    status = main()
    begin_shutdown()
    exit_process(status)
