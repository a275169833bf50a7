#!/usr/bin/env python3
"""Checks a node by the criteria of its lab, as a rostest: one test for each criterion.

Started by check_LAB.test. Parameters
    ~lab        imu, turn, move2goal or gamepad
    ~pkg        package of the node
    ~type       its file, as rosrun knows it
    ~points     YAML file with the points of each criterion
    ~parts      these parts of the lab alone, with commas; empty: all
    ~record     file to which the observation is written; empty: none
    ~pad        gamepad alone: numbers of the pad, launch/params/pad_NAME.yaml
    ~strict     whether criteria beyond the handout fail the test too
"""
import os
import sys
import unittest
from dataclasses import fields

import rospy
import rostest
import yaml

from tb3_labs.marking.criteria import Outcome, judge
from tb3_labs.marking.labs import GAMEPAD, LABS
from tb3_labs.marking.points import points_of
from tb3_labs.ros.marking.pads import HANDOUT, pad_called
from tb3_labs.ros.marking.trial import try_out


def observe():
    """Try the node out; the verdicts."""
    name, package, executable, points, parts, record = (rospy.get_param('~' + name) for name in (
        'lab', 'pkg', 'type', 'points', 'parts', 'record'))
    if name not in LABS:
        raise ValueError('there is no lab {!r}: {}'.format(name, ', '.join(LABS)))
    lab = LABS[name]
    parts = lab.checked_parts(parts)
    for known in ('lab', 'points', 'parts', 'record'):      # a node need not read them
        rospy.delete_param('~' + known)
    with open(points) as file:
        worth = points_of(name, lab.criteria, yaml.safe_load(file))
    pad = pad_called(rospy.get_param('~pad', HANDOUT))
    if name == GAMEPAD:    # for a node that reads its numbers, as this package's
        rospy.set_param('/' + GAMEPAD, {item.name: getattr(pad, item.name) for item in fields(pad)})

    def keep(observation):
        if record:
            with open(record + '.part', 'w') as file:
                file.write(observation.to_json())
            os.replace(record + '.part', record)
    observation = try_out(name, package, executable, parts, keep, pad)
    return judge(lab.criteria, observation, worth, parts)


def test_of(verdict, strict):
    """A test method that fails with a Verdict that is not met."""
    def test(self):
        if verdict.outcome is Outcome.MET:
            return
        message = '{}: {} ({:g} of {:g} points). Asked: {}'.format(
            verdict.outcome.value, verdict.sentence, verdict.points, verdict.worth,
            verdict.criterion.meaning)
        if verdict.criterion.extra and not strict:
            self.skipTest(message)
        self.fail(message)
    return test


def main():
    """Try the node out, judge it, report as a rostest."""
    rospy.init_node('check')
    try:
        verdicts = observe()
    except (OSError, ValueError, yaml.YAMLError) as problem:
        sys.exit('check_lab.py: {}'.format(problem))
    strict = rospy.get_param('~strict')
    tests = {'test_' + verdict.criterion.label: test_of(verdict, strict) for verdict in verdicts}
    rostest.rosrun('tb3_labs', 'check', type('Check', (unittest.TestCase,), tests))


if __name__ == '__main__':
    main()
