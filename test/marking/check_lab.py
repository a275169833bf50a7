#!/usr/bin/env python3
"""Checks a node by the criteria of its lab, as a rostest: one test for each criterion.

Started by check_LAB.test. Parameters
    ~lab        imu, turn, move2goal, gamepad
    ~pkg        package of the node
    ~type       its file, as rosrun knows it
    ~points     YAML file with the points of each criterion
    ~parts      only these parts of the lab, with commas; empty: all
    ~record     file to which the observation is written; empty: none
    ~strict     criteria beyond the handout fail the test too
"""
import os
import sys
import unittest

import rospy
import rostest
import yaml

from tb3_labs.marking.criteria import Outcome, judge
from tb3_labs.marking.labs import LABS
from tb3_labs.marking.points import points_of
from tb3_labs.ros.marking.trial import try_out


def observe():
    """The Observation, and its verdicts."""
    given = {name: rospy.get_param('~' + name) for name in (
        'lab', 'pkg', 'type', 'points', 'parts', 'record')}
    parts = [part.strip() for part in given['parts'].split(',') if part.strip()]
    lab = LABS[given['lab']]
    with open(given['points']) as file:
        worth = points_of(given['lab'], lab.criteria, yaml.safe_load(file))

    def keep(observation):
        if given['record']:
            with open(given['record'] + '.part', 'w') as file:
                file.write(observation.to_json())
            os.replace(given['record'] + '.part', given['record'])
    observation = try_out(given['lab'], given['pkg'], given['type'], parts, keep)
    return judge(lab.criteria, observation, worth, parts)


def test_of(verdict, strict):
    """A test method that tells a Verdict."""
    def test(self):
        if verdict.outcome is Outcome.MET:
            return
        message = '{}: {} ({:g} of {:g} points)'.format(
            verdict.outcome.value, verdict.sentence, verdict.points, verdict.worth)
        if verdict.criterion.extra and not strict:
            self.skipTest(message)
        self.fail(message)
    return test


def main():
    """Try out, judge, report as a rostest."""
    rospy.init_node('check')
    try:
        verdicts = observe()
    except (OSError, ValueError, yaml.YAMLError) as problem:
        sys.exit('check_lab.py: {}'.format(problem))
    strict = rospy.get_param('~strict')
    tests = {'test_{}{}'.format('extra_' if v.criterion.extra else '', v.criterion.name):
             test_of(v, strict) for v in verdicts}
    rostest.rosrun('tb3_labs', 'check', type('Check', (unittest.TestCase,), tests))


if __name__ == '__main__':
    main()
